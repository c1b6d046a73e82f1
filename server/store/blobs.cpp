#include "server/store/blobs.h"

#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "server/store/files.h"
#include "server/store/sha256.h"

namespace penumbra::store {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view temporary_suffix = ".part";

bool is_hexadecimal(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

/// Of a file that a write was interrupted in.
bool is_temporary_name(const std::string& text) {
  constexpr std::size_t name_size = 64;
  return text.ends_with(temporary_suffix) && text.size() > name_size && is_blob_name(text.substr(0, name_size));
}

}  // namespace

bool is_blob_name(const std::string& text) { return text.size() == 64 && is_hexadecimal(text); }

Blobs::Blobs(std::string directory) : directory_(std::move(directory)) {
  constexpr std::string_view digits = "0123456789abcdef";
  make_directory(directory_);
  // All at once, so that no write has to wonder whether the name of its directory is durable.
  for (const char high : digits) {
    for (const char low : digits) fs::create_directory(directory_ + "/" + high + low);
  }
  sync_directory(directory_);
}

Blobs::Hold::Hold(Blobs& blobs, std::string name) : blobs_(blobs), name_(std::move(name)) {
  const std::lock_guard lock(blobs_.mutex_);
  ++blobs_.holds_[name_];
}

Blobs::Hold::~Hold() {
  const std::lock_guard lock(blobs_.mutex_);
  const auto hold = blobs_.holds_.find(name_);
  if (--hold->second == 0) blobs_.holds_.erase(hold);
}

void Blobs::write(const std::string& name, const std::string& bytes) {
  const std::string directory = directory_of(name);
  const std::string temporary = path_of(name) + "." + std::to_string(next_temporary_++) + std::string(temporary_suffix);
  try {
    write_file(temporary, bytes);
    rename_file(temporary, path_of(name));
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
  sync_directory(directory);
}

std::shared_ptr<const std::string> Blobs::read(const std::string& name) {
  const auto being_read = [&]() -> std::shared_ptr<const std::string> {
    const std::lock_guard lock(mutex_);
    const auto found = being_read_.find(name);
    return found == being_read_.end() ? nullptr : found->second.lock();
  };
  if (auto shared = being_read()) return shared;
  auto bytes = std::make_shared<const std::string>(read_file(path_of(name)));
  if (sha256_hex(*bytes) != name) {
    spdlog::error("the image {} is damaged", path_of(name));
    remove(name);
    throw std::system_error(ENOENT, std::generic_category(), path_of(name));
  }
  const std::lock_guard lock(mutex_);
  std::erase_if(being_read_, [](const auto& entry) { return entry.second.expired(); });
  // Another thread may have been quicker.
  std::weak_ptr<const std::string>& shared = being_read_[name];
  if (auto quicker = shared.lock()) return quicker;
  shared = bytes;
  return bytes;
}

bool Blobs::is_there(const std::string& name, std::uint64_t bytes) const {
  struct stat status {};
  return ::lstat(path_of(name).c_str(), &status) == 0 && S_ISREG(status.st_mode) &&
         static_cast<std::uint64_t>(status.st_size) == bytes;
}

void Blobs::remove(const std::string& name) {
  try {
    const std::lock_guard lock(mutex_);
    if (!holds_.contains(name)) remove_file(path_of(name));
  } catch (const std::system_error& error) {
    spdlog::warn("an image that is no longer needed stays: {}", error.what());
  }
}

void Blobs::collect(const std::function<bool(const std::string& name)>& is_wanted) {
  for (const std::string& prefix : names_in(directory_)) {
    const std::string directory = directory_ + "/" + prefix;
    if (prefix.size() != 2 || !is_hexadecimal(prefix) || !is_directory(directory)) continue;
    for (const std::string& name : names_in(directory)) {
      const bool is_blob = is_blob_name(name) && name.starts_with(prefix);
      const bool is_ours = is_blob || is_temporary_name(name);
      if (!is_ours || (is_blob && is_wanted(name))) continue;
      const std::string path = std::string(directory).append("/").append(name);
      if (!is_directory(path)) remove_file(path);
    }
  }
}

bool Blobs::is_empty() const {
  const std::vector<std::string> prefixes = names_in(directory_);
  return std::none_of(prefixes.begin(), prefixes.end(), [&](const std::string& prefix) {
    const std::string directory = directory_ + "/" + prefix;
    return is_directory(directory) && !names_in(directory).empty();
  });
}

}  // namespace penumbra::store
