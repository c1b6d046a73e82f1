#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace penumbra::store {

/// An fsync has failed: what the disk holds is unknown, and a second fsync would only seem to help.
class SyncError : public std::system_error {
 public:
  using std::system_error::system_error;
};

/// A descriptor, closed at the end.
class File {
 public:
  File(const std::string& path, int flags, unsigned mode = 0600);
  ~File();
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

// All of these throw std::system_error that names the path.

/// Makes a directory that only its owner may read, and those above it, durably. One that is there is left as it is.
void make_directory(const std::string& path);
/// Writes a new file and fsyncs it. The name becomes durable with `sync_directory`.
void write_file(const std::string& path, std::string_view bytes);
std::string read_file(const std::string& path);
void rename_file(const std::string& from, const std::string& to);
/// False when there was no such file.
bool remove_file(const std::string& path);
/// Of everything in a directory but `.` and `..`.
std::vector<std::string> names_in(const std::string& directory);
/// Whether there is a directory of this name, and not only a link to one.
bool is_directory(const std::string& path);
/// fsyncs the names in a directory.
void sync_directory(const std::string& path);
/// Bytes that may still be written to the file system of `path`.
std::uint64_t free_bytes(const std::string& path);

}  // namespace penumbra::store
