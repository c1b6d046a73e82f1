#include "server/access/key_ring.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <system_error>

namespace penumbra::access {

namespace {

constexpr auto look_interval = std::chrono::milliseconds(500);

/// What changes when a file does.
using Mark = std::array<std::int64_t, 4>;

std::optional<Mark> mark_of(const std::string& path) {
  struct stat state {};
  if (::stat(path.c_str(), &state) != 0) return std::nullopt;
  return Mark{static_cast<std::int64_t>(state.st_ino), state.st_size, state.st_mtim.tv_sec, state.st_mtim.tv_nsec};
}

[[noreturn]] void fail(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

}  // namespace

KeyRing::KeyRing(std::string path) : path_(std::move(path)) {
  auto keys = std::make_shared<Keys>();
  for (Key& key : parse_keys(read_keys(path_))) keys->emplace(key.id, std::make_shared<const Key>(key));
  keys_ = std::move(keys);
  watcher_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
}

KeyRing::~KeyRing() = default;

std::shared_ptr<const Key> KeyRing::find(std::string_view text) const {
  std::shared_ptr<const Keys> keys;
  {
    const std::lock_guard lock(mutex_);
    keys = keys_;
  }
  const std::optional<std::string_view> id = id_of(text);
  const auto found = id ? keys->find(*id) : keys->end();
  if (found == keys->end() || !is_text_of(*found->second, text)) return nullptr;
  return found->second;
}

void KeyRing::reload() {
  try {
    auto keys = std::make_shared<Keys>();
    for (Key& key : parse_keys(read_keys(path_))) keys->emplace(key.id, std::make_shared<const Key>(key));
    spdlog::info("{} keys read from {}", keys->size(), path_);
    const std::lock_guard lock(mutex_);
    keys_ = std::move(keys);
  } catch (const std::exception& error) {
    spdlog::error("the keys stay as they were, {}: {}", path_, error.what());
  }
}

void KeyRing::watch(const std::stop_token& stop) {
  std::optional<Mark> seen = mark_of(path_);
  while (true) {
    {
      std::unique_lock lock(mutex_);
      time_passes_.wait_for(lock, stop, look_interval, [] { return false; });
    }
    if (stop.stop_requested()) return;
    const std::optional<Mark> mark = mark_of(path_);
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
