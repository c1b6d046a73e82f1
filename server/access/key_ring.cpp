#include "server/access/key_ring.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>

namespace penumbra::access {

namespace {

constexpr auto look_interval = std::chrono::milliseconds(200);

KeyRing::Mark mark_of(const std::string& path) {
  struct stat state {};
  if (::stat(path.c_str(), &state) != 0) return {};
  return {static_cast<std::int64_t>(state.st_ino), state.st_size, state.st_mtim.tv_sec, state.st_mtim.tv_nsec};
}

[[noreturn]] void fail(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

}  // namespace

KeyRing::KeyRing(std::string path) : path_(std::move(path)) {
  const Mark before = mark_of(path_);  // what changes after it is noticed
  take(read_keys(path_));
  watcher_ = std::jthread([this, before](const std::stop_token& stop) { watch(stop, before); });
}

KeyRing::~KeyRing() = default;

std::shared_ptr<const Key> KeyRing::find(std::string_view text) const {
  const std::optional<std::string_view> id = id_of(text);
  std::shared_ptr<const Key> key = id ? find_id(*id) : nullptr;
  return key && is_text_of(*key, text) ? key : nullptr;
}

std::shared_ptr<const Key> KeyRing::find_id(std::string_view id) const {
  std::shared_ptr<const Keys> keys;
  {
    const std::lock_guard lock(mutex_);
    keys = keys_;
  }
  const auto found = keys->find(id);
  return found == keys->end() ? nullptr : found->second;
}

void KeyRing::take(const std::string& text) {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) throw std::runtime_error("the file is empty");
  auto keys = std::make_shared<Keys>();
  for (Key& key : parse_keys(text)) keys->emplace(key.id, std::make_shared<const Key>(key));
  {
    const std::lock_guard lock(mutex_);
    if (is_last_line_ended_ && !text.ends_with('\n'))
      throw std::runtime_error("the last line has no end any more, as if the file were cut off");
    is_last_line_ended_ = text.ends_with('\n');
    keys_ = keys;
  }
  spdlog::info("{} keys read from {}", keys->size(), path_);
}

void KeyRing::reload() {
  try {
    take(read_keys(path_));
  } catch (const std::exception& error) {
    spdlog::error("the keys stay as they were, {}: {}", path_, error.what());
  }
}

void KeyRing::watch(const std::stop_token& stop, Mark seen) {
  while (true) {
    {
      std::unique_lock lock(mutex_);
      time_passes_.wait_for(lock, stop, look_interval, [] { return false; });
    }
    if (stop.stop_requested()) return;
    const Mark mark = mark_of(path_);
    if (mark == seen) continue;
    seen = mark;
    reload();
  }
}

std::string read_keys(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("the keys cannot be read: " + path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void write_keys(const std::string& path, const std::string& text) {
  const std::string temporary = path + ".new";
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (file < 0) fail(temporary);
  const bool is_written =
      ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && ::fsync(file) == 0;
  const int error = errno;
  ::close(file);
  errno = error;
  if (!is_written || ::rename(temporary.c_str(), path.c_str()) != 0) fail(temporary);
}

}  // namespace penumbra::access
