#include "server/store/files.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <memory>

namespace penumbra::store {

namespace {

[[noreturn]] void fail(const std::string& path) { throw std::system_error(errno, std::generic_category(), path); }

void sync(const File& file, const std::string& path) {
  if (::fsync(file.descriptor()) != 0) throw SyncError(errno, std::generic_category(), "fsync of " + path);
}

}  // namespace

File::File(const std::string& path, int flags, unsigned mode)
    : descriptor_(::open(path.c_str(), flags | O_CLOEXEC | O_NOFOLLOW, mode)) {
  if (descriptor_ < 0) fail(path);
}

File::~File() { ::close(descriptor_); }

void make_directory(const std::string& path) {
  const std::filesystem::path whole(path);
  if (::mkdir(path.c_str(), 0700) != 0) {
    if (errno == ENOENT && whole.has_parent_path() && whole.parent_path() != whole) {
      make_directory(whole.parent_path());
      if (::mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) fail(path);
    } else if (errno != EEXIST) {
      fail(path);
    } else {
      if (!std::filesystem::is_directory(whole)) throw std::system_error(ENOTDIR, std::generic_category(), path);
      return;
    }
  }
  sync_directory(whole.has_parent_path() ? whole.parent_path().string() : ".");
}

void write_file(const std::string& path, std::string_view bytes) {
  const File file(path, O_WRONLY | O_CREAT | O_TRUNC);
  while (!bytes.empty()) {
    const ssize_t count = ::write(file.descriptor(), bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(path);
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  sync(file, path);
}

std::string read_file(const std::string& path) {
  const File file(path, O_RDONLY);
  struct stat status {};
  if (::fstat(file.descriptor(), &status) != 0) fail(path);
  if (!S_ISREG(status.st_mode)) throw std::system_error(EINVAL, std::generic_category(), path);
  std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::read(file.descriptor(), bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(path);
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  bytes.resize(done);
  return bytes;
}

void rename_file(const std::string& from, const std::string& to) {
  if (::rename(from.c_str(), to.c_str()) != 0) fail(to);
}

bool remove_file(const std::string& path) {
  if (::unlink(path.c_str()) == 0) return true;
  if (errno != ENOENT) fail(path);
  return false;
}

std::vector<std::string> names_in(const std::string& directory) {
  // std::filesystem's iterator ends the program when it runs out of memory.
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(::opendir(directory.c_str()), &::closedir);
  if (!entries) fail(directory);
  std::vector<std::string> names;
  for (;;) {
    errno = 0;  // readdir alone tells neither its end nor its failure
    // Safe for streams that are not shared. NOLINTNEXTLINE(concurrency-mt-unsafe)
    const dirent* const entry = ::readdir(entries.get());
    if (entry == nullptr) break;
    std::string name = entry->d_name;
    if (name != "." && name != "..") names.push_back(std::move(name));
  }
  if (errno != 0) fail(directory);
  return names;
}

bool is_directory(const std::string& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
}

void sync_directory(const std::string& path) {
  const File directory(std::filesystem::canonical(path), O_RDONLY | O_DIRECTORY);
  sync(directory, path);
}

std::uint64_t free_bytes(const std::string& path) {
  struct statvfs status {};
  if (::statvfs(path.c_str(), &status) != 0) fail(path);
  return std::uint64_t{status.f_bavail} * status.f_frsize;
}

}  // namespace penumbra::store
