// A library to be preloaded: while it is armed, calls to the system and to the allocator fail as they are told to.
#include "tests/support/faulty_calls.h"

#include <dlfcn.h>
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

ssize_t write(int file, const void* bytes, std::size_t size) {
  static const auto real = next<decltype(write)>("write");
  // The log goes to the standard streams, and is nothing a store depends on.
  if (file > STDERR_FILENO && is_to_fail(Fault::write)) return -1;
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

void* malloc(std::size_t size) noexcept { return is_to_fail(Fault::allocation) ? nullptr : __libc_malloc(size); }

void* calloc(std::size_t count, std::size_t size) noexcept {
  return is_to_fail(Fault::allocation) ? nullptr : __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) noexcept {
  return is_to_fail(Fault::allocation) ? nullptr : __libc_realloc(memory, size);
}
}
