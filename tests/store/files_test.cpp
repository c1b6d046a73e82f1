#include "server/store/files.h"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>

#include "tests/support/temporary_directory.h"

using namespace penumbra::store;
using penumbra::test::TemporaryDirectory;
namespace fs = std::filesystem;

namespace {

/// The number of the error that a call ends with; 0 for none.
template <class Call>
int error_of(const Call& call) {
  try {
    call();
  } catch (const std::system_error& error) {
    return error.code().value();
  }
  return 0;
}

}  // namespace

TEST_CASE("a file is read as it was written, whatever its bytes") {
  const TemporaryDirectory directory;
  const std::string path = directory / "file";
  for (const std::string& bytes : {std::string(), std::string("a\0b\xff", 4), std::string(3'000'000, 'x')}) {
    write_file(path, bytes);
    CHECK(read_file(path) == bytes);
  }
  CHECK(error_of([&] { read_file(directory / "none"); }) == ENOENT);
  CHECK(error_of([&] { read_file(directory.path()); }) == EINVAL);
  CHECK(error_of([&] { write_file(directory / "none/file", ""); }) == ENOENT);
  fs::create_symlink("file", directory / "link");
  CHECK(error_of([&] { read_file(directory / "link"); }) == ELOOP);
}

TEST_CASE("a file is renamed and removed, and it is told when there is none") {
  const TemporaryDirectory directory;
  write_file(directory / "a", "bytes");
  rename_file(directory / "a", directory / "b");
  CHECK(read_file(directory / "b") == "bytes");
  CHECK(error_of([&] { rename_file(directory / "a", directory / "b"); }) == ENOENT);
  CHECK(remove_file(directory / "b"));
  CHECK_FALSE(remove_file(directory / "b"));
  write_file(directory / "file", "");
  CHECK(error_of([&] { remove_file(directory / "file/b"); }) == ENOTDIR);
}

TEST_CASE("directories are made with those above them, and left when they are there") {
  const TemporaryDirectory directory;
  make_directory(directory / "a/b/c");
  CHECK(is_directory(directory / "a/b/c"));
  CHECK((fs::status(directory / "a").permissions() & fs::perms::all) == fs::perms::owner_all);
  write_file(directory / "a/file", "");
  make_directory(directory / "a");
  CHECK(fs::exists(directory / "a/file"));
  CHECK(error_of([&] { make_directory(directory / "a/file"); }) == ENOTDIR);
  CHECK(error_of([&] { make_directory(directory / "a/file/b"); }) == ENOTDIR);
  CHECK_FALSE(is_directory(directory / "a/file"));
  CHECK_FALSE(is_directory(directory / "none"));
  fs::create_directory_symlink("a", directory / "link");
  CHECK_FALSE(is_directory(directory / "link"));
  make_directory(directory / "link");
  CHECK(error_of([&] { sync_directory(directory / "none"); }) == ENOENT);
}

TEST_CASE("the names in a directory, whatever failed before") {
  const TemporaryDirectory directory;
  errno = EIO;
  CHECK(names_in(directory.path()).empty());
  for (const char* name : {"b", "a", ".c"}) write_file(directory / name, "");
  std::vector<std::string> names = names_in(directory.path());
  std::ranges::sort(names);
  CHECK(names == std::vector<std::string>{".c", "a", "b"});
  CHECK(error_of([&] { names_in(directory / "none"); }) == ENOENT);
}

TEST_CASE("the room on a disk is that of its file system") {
  const TemporaryDirectory directory;
  const auto expected = static_cast<double>(fs::space(directory.path()).available);
  const auto found = static_cast<double>(free_bytes(directory.path()));
  CHECK(found > 0.9 * expected);
  CHECK(found < 1.1 * expected);
  CHECK(error_of([&] { free_bytes(directory / "none"); }) == ENOENT);
}
