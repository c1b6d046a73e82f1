// A library to be preloaded: while it is armed, calls to the system and to the allocator fail as they are told to. A
// program that knows nothing of it is armed by FAULT="KIND FIRST LAST ERRNO" in its environment.
#include "tests/support/faulty_calls.h"

#include <dlfcn.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>

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
  armed_kind = kind;
}

long disarm_fault() {
  armed_kind = -1;
  return calls;
}

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
  return real(file, bytes, size);
}

ssize_t pwrite(int file, const void* bytes, std::size_t size, off_t offset) {
  static const auto real = next<decltype(pwrite)>("pwrite");
  return is_to_fail(Fault::write) ? -1 : real(file, bytes, size, offset);
}

ssize_t pwrite64(int file, const void* bytes, std::size_t size, off64_t offset) {
  static const auto real = next<decltype(pwrite64)>("pwrite64");
  return is_to_fail(Fault::write) ? -1 : real(file, bytes, size, offset);
}

int fsync(int file) {
  static const auto real = next<decltype(fsync)>("fsync");
  return is_to_fail(Fault::sync) ? -1 : real(file);
}

int fdatasync(int file) {
  static const auto real = next<decltype(fdatasync)>("fdatasync");
  return is_to_fail(Fault::sync) ? -1 : real(file);
}

int rename(const char* from, const char* to) noexcept {
  static const auto real = next<int(const char*, const char*)>("rename");
  return is_to_fail(Fault::rename) ? -1 : real(from, to);
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
