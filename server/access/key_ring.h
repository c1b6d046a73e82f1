#pragma once
#include <array>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "server/access/key.h"

namespace penumbra::access {

/// The keys of a file, read again within a second of a change. A file that has become unreadable, wrong or empty, or
/// whose last line has lost its end, changes nothing but the log: it may have been caught half-written. One that is to
/// hold no key says something else, such as a comment. May be shared between threads.
class KeyRing {
 public:
  /// Throws std::runtime_error when the file cannot be read, or would change nothing later on.
  explicit KeyRing(std::string path);
  ~KeyRing();
  KeyRing(const KeyRing&) = delete;
  KeyRing& operator=(const KeyRing&) = delete;

  /// What changes when a file does: inode, size, time of change; zeros when there is none.
  using Mark = std::array<std::int64_t, 4>;

  /// The key with this text; null when there is none.
  std::shared_ptr<const Key> find(std::string_view text) const;
  /// The key with this id, for who has proved otherwise to be its holder; null when there is none.
  std::shared_ptr<const Key> find_id(std::string_view id) const;
  /// Reads the file now.
  void reload();

 private:
  using Keys = std::map<std::string, std::shared_ptr<const Key>, std::less<>>;  // by id

  /// Throws std::runtime_error when the text is not to be trusted.
  void take(const std::string& text);
  void watch(const std::stop_token& stop, Mark seen);

  const std::string path_;
  mutable std::mutex mutex_;
  std::condition_variable_any time_passes_;
  // Guarded by mutex_:
  std::shared_ptr<const Keys> keys_;
  bool is_last_line_ended_ = false;  // of the text they are from

  std::jthread watcher_;
};

/// Replaces or makes a file of keys that only its owner may read: all of it or nothing. Throws std::system_error.
void write_keys(const std::string& path, const std::string& text);
/// Throws std::runtime_error when there is no such file.
std::string read_keys(const std::string& path);

}  // namespace penumbra::access
