// A library to be preloaded: while it is armed, calls to the system and to the allocator fail as they are told to. A
// program that knows nothing of it is armed by FAULT="KIND FIRST LAST ERRNO" in its environment.
#include "tests/support/faulty_calls.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <string_view>

using penumbra::test::Fault;

extern "C" {
// glibc's allocator under the names that cannot be replaced. NOLINTBEGIN(bugprone-reserved-identifier)
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
// NOLINTEND(bugprone-reserved-identifier)
}

namespace {

std::atomic<int> armed_kind = -1, error_code = 0;
std::atomic<long> calls = 0, first_to_fail = 0, last_to_fail = 0;

/// Sockets, pipes and the standard streams are nothing a store depends on.
bool is_regular_file(int file) {
  struct stat status {};
  return ::fstat(file, &status) == 0 && S_ISREG(status.st_mode);
}

bool is_to_fail(Fault kind) {
  if (armed_kind.load() != static_cast<int>(kind)) return false;
  const long call = ++calls;
  if (call < first_to_fail || call > last_to_fail) return false;
  errno = error_code;
  return true;
}

/// What a read or write of `size` bytes does.
std::size_t part_of(std::size_t size) { return is_to_fail(Fault::part) ? (size + 1) / 2 : size; }

/// What an fsync has yet to reach, by inode; without allocations.
class Unsynced {
 public:
  void clear() {
    const Lock lock(mutex_);
    count_ = 0;
  }
  long count() {
    const Lock lock(mutex_);
    return static_cast<long>(count_);
  }
  void add(const struct stat& status) {
    if (armed_kind < 0) return;
    const Lock lock(mutex_);
    if (find(status) == end() && count_ < inodes_.size()) inodes_[count_++] = {status.st_dev, status.st_ino};
  }
  void add_file(int file) {
    struct stat status {};
    if (armed_kind >= 0 && ::fstat(file, &status) == 0 && S_ISREG(status.st_mode) && !is_shared_memory(file))
      add(status);
  }
  void add_directory_of(std::string_view path) {
    char directory[4096] = ".";
    const std::size_t size = path.rfind('/');
    if (armed_kind < 0 || (size != std::string_view::npos && size >= sizeof directory)) return;
    if (size != std::string_view::npos) directory[path.copy(directory, std::max<std::size_t>(size, 1))] = 0;
    struct stat status {};
    if (::stat(directory, &status) == 0) add(status);
  }
  void remove(int file) {
    struct stat status {};
    if (armed_kind < 0 || ::fstat(file, &status) != 0) return;
    const Lock lock(mutex_);
    if (const auto found = find(status); found != end()) *found = inodes_[--count_];
  }

 private:
  struct Inode {
    dev_t device = 0;
    ino_t number = 0;
  };
  struct Lock {
    explicit Lock(pthread_mutex_t& given) : mutex(given) { pthread_mutex_lock(&mutex); }
    ~Lock() { pthread_mutex_unlock(&mutex); }
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;
    pthread_mutex_t& mutex;
  };
  /// SQLite's index of its log, which every start makes anew.
  static bool is_shared_memory(int file) {
    char link[32], path[4096];
    std::snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    const ssize_t size = ::readlink(link, path, sizeof path);
    return size > 0 && std::string_view(path, static_cast<std::size_t>(size)).ends_with("-shm");
  }
  Inode* end() { return inodes_.data() + count_; }
  Inode* find(const struct stat& status) {
    return std::find_if(inodes_.data(), end(), [&](const Inode& inode) {
      return inode.device == status.st_dev && inode.number == status.st_ino;
    });
  }

  pthread_mutex_t mutex_ = PTHREAD_MUTEX_INITIALIZER;
  std::array<Inode, 1000> inodes_{};
  std::size_t count_ = 0;
};

constinit Unsynced unsynced;

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

void arm_fault(int kind, long first, long last, int error) {
  calls = 0;
  first_to_fail = first;
  last_to_fail = last;
  error_code = error;
  unsynced.clear();
  armed_kind = kind;
}

long disarm_fault() {
  armed_kind = -1;
  return calls;
}

long unsynced_files() { return unsynced.count(); }

[[gnu::constructor]] void arm_from_environment() {
  const char* const text = std::getenv("FAULT");
  int kind = 0, error = 0;
  long first = 0, last = 0;
  if (text != nullptr && std::sscanf(text, "%d %ld %ld %d", &kind, &first, &last, &error) == 4)
    arm_fault(kind, first, last, error);
}

ssize_t write(int file, const void* bytes, std::size_t size) {
  static const auto real = next<decltype(write)>("write");
  if (armed_kind == static_cast<int>(Fault::write) && is_regular_file(file) && is_to_fail(Fault::write)) return -1;
  unsynced.add_file(file);
  return real(file, bytes, part_of(size));
}

ssize_t read(int file, void* bytes, std::size_t size) {
  static const auto real = next<decltype(read)>("read");
  return real(file, bytes, part_of(size));
}

ssize_t pwrite(int file, const void* bytes, std::size_t size, off_t offset) {
  static const auto real = next<decltype(pwrite)>("pwrite");
  if (is_to_fail(Fault::write)) return -1;
  unsynced.add_file(file);
  return real(file, bytes, part_of(size), offset);
}

ssize_t pwrite64(int file, const void* bytes, std::size_t size, off64_t offset) {
  static const auto real = next<decltype(pwrite64)>("pwrite64");
  if (is_to_fail(Fault::write)) return -1;
  unsynced.add_file(file);
  return real(file, bytes, part_of(size), offset);
}

int fsync(int file) {
  static const auto real = next<decltype(fsync)>("fsync");
  if (is_to_fail(Fault::sync)) return -1;
  unsynced.remove(file);
  return real(file);
}

int fdatasync(int file) {
  static const auto real = next<decltype(fdatasync)>("fdatasync");
  if (is_to_fail(Fault::sync)) return -1;
  unsynced.remove(file);
  return real(file);
}

int rename(const char* from, const char* to) noexcept {
  static const auto real = next<int(const char*, const char*)>("rename");
  if (is_to_fail(Fault::rename)) return -1;
  unsynced.add_directory_of(to);
  return real(from, to);
}

int mkdir(const char* path, mode_t mode) noexcept {
  static const auto real = next<int(const char*, mode_t)>("mkdir");
  const int result = real(path, mode);
  if (result == 0) unsynced.add_directory_of(path);
  return result;
}

int open(const char* path, int flags, ...) {
  static const auto real = next<decltype(open)>("open");
  if (is_to_fail(Fault::open)) return -1;
  mode_t mode = 0;
  if ((flags & O_CREAT) != 0) {
    va_list more;
    va_start(more, flags);
    mode = va_arg(more, mode_t);
    va_end(more);
  }
  const bool is_new = (flags & O_CREAT) != 0 && ::access(path, F_OK) != 0;
  const int file = real(path, flags, mode);
  if (is_new && file >= 0) unsynced.add_directory_of(path);
  return file;
}

int open64(const char* path, int flags, ...) {
  mode_t mode = 0;
  if ((flags & O_CREAT) != 0) {
    va_list more;
    va_start(more, flags);
    mode = va_arg(more, mode_t);
    va_end(more);
  }
  return open(path, flags, mode);
}

int accept(int socket, sockaddr* address, socklen_t* size) {
  static const auto real = next<decltype(accept)>("accept");
  return is_to_fail(Fault::accept) ? -1 : real(socket, address, size);
}

int accept4(int socket, sockaddr* address, socklen_t* size, int flags) {
  static const auto real = next<decltype(accept4)>("accept4");
  return is_to_fail(Fault::accept) ? -1 : real(socket, address, size, flags);
}

void* malloc(std::size_t size) noexcept { return is_to_fail(Fault::allocation) ? nullptr : __libc_malloc(size); }

void* calloc(std::size_t count, std::size_t size) noexcept {
  return is_to_fail(Fault::allocation) ? nullptr : __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) noexcept {
  return is_to_fail(Fault::allocation) ? nullptr : __libc_realloc(memory, size);
}
}
