#pragma once
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "server/access/key.h"

namespace penumbra::access {

/// The keys of a file, read again within a second of a change. A file that has become unreadable or wrong changes
/// nothing but the log. May be shared between threads.
class KeyRing {
 public:
  /// Throws std::runtime_error when the file cannot be read.
  explicit KeyRing(std::string path);
  ~KeyRing();
  KeyRing(const KeyRing&) = delete;
  KeyRing& operator=(const KeyRing&) = delete;

  /// The key with this text; null when there is none.
  std::shared_ptr<const Key> find(std::string_view text) const;
  /// Reads the file now.
  void reload();

 private:
  using Keys = std::map<std::string, std::shared_ptr<const Key>, std::less<>>;  // by id

  void watch(const std::stop_token& stop);

  const std::string path_;
  mutable std::mutex mutex_;
  std::condition_variable_any time_passes_;
  std::shared_ptr<const Keys> keys_;  // guarded by mutex_
  std::jthread watcher_;
};

/// Replaces or makes a file of keys that only its owner may read: all of it or nothing. Throws std::system_error.
void write_keys(const std::string& path, const std::string& text);
/// Throws std::runtime_error when there is no such file.
std::string read_keys(const std::string& path);

}  // namespace penumbra::access
