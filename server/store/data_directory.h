#pragma once
#include <memory>
#include <string>

#include "server/store/files.h"

namespace penumbra::store {

/// The directory a store lives in, locked against a second server for as long as this lives:
///
///     lock        held by the server that runs
///     unclean     there while a server runs, and after one that did not stop in order
///     penumbra.db, -wal, -shm     the database
///     blobs/ab/abcd…              images, each named by its SHA-256
class DataDirectory {
 public:
  /// Makes it when it is not there. Throws std::runtime_error when another server uses it.
  explicit DataDirectory(std::string path);

  const std::string& path() const { return path_; }
  std::string database() const { return path_ + "/penumbra.db"; }
  std::string blobs() const { return path_ + "/blobs"; }

  /// Whether the last server did not stop in order.
  bool is_unclean() const;
  /// Remembers that a server runs, durably.
  void mark_unclean();
  /// To be called last of all, and only when everything is on the disk.
  void mark_clean();

 private:
  std::string unclean() const { return path_ + "/unclean"; }

  std::string path_;
  std::unique_ptr<File> lock_;
};

}  // namespace penumbra::store
