#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace penumbra::store {

/// Whether `text` could be the SHA-256 that names a blob.
bool is_blob_name(const std::string& text);

/// Files named by the SHA-256 of what they hold: DIRECTORY/ab/abcd…. One that is complete is never changed. May be
/// shared between threads.
class Blobs {
 public:
  explicit Blobs(std::string directory);

  /// Keeps a blob from being removed between its writing and the commit of the row that refers to it.
  class Hold {
   public:
    Hold(Blobs& blobs, std::string name);
    ~Hold();
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    Blobs& blobs_;
    std::string name_;
  };

  /// Writes a blob so that it survives a crash: a temporary file beside its place, fsync, rename, fsync of the
  /// directory. Throws std::system_error.
  void write(const std::string& name, const std::string& bytes);
  /// All who read a blob at the same time share its bytes. Throws std::system_error, with ENOENT when it is gone; one
  /// that is not what was written is removed and gone.
  std::shared_ptr<const std::string> read(const std::string& name);
  /// Whether it is there, with this many bytes.
  bool is_there(const std::string& name, std::uint64_t bytes) const;
  /// Removes a blob that nobody holds. A failure is not worth more than a line in the log: the next start collects it.
  void remove(const std::string& name);
  /// Removes the temporary files of interrupted writes and the blobs that are not wanted. Files with other names are
  /// not ours and stay.
  void collect(const std::function<bool(const std::string& name)>& is_wanted);
  bool is_empty() const;

 private:
  std::string directory_of(const std::string& name) const { return directory_ + "/" + name.substr(0, 2); }
  std::string path_of(const std::string& name) const { return directory_of(name) + "/" + name; }

  const std::string directory_;
  std::atomic<std::uint64_t> next_temporary_ = 0;
  std::mutex mutex_;
  // Guarded by mutex_:
  std::map<std::string, int> holds_;
  std::map<std::string, std::weak_ptr<const std::string>> being_read_;
};

}  // namespace penumbra::store
