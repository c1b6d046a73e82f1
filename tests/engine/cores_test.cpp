// How many processors a control group leaves: files as Linux has them, in a folder of our own.
#include "engine/render/cores.h"

#include <doctest/doctest.h>

#include <fstream>

#include "tests/support/temporary_directory.h"

using namespace penumbra;
namespace fs = std::filesystem;

namespace {

void write(const fs::path& file, const char* text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

}  // namespace

TEST_CASE("a control group grants what its files say, and what those around it leave") {
  const test::TemporaryDirectory folder;
  const fs::path root = folder.path();
  CHECK_FALSE(render::granted_cores(root / "no/such", root));

  write(root / "two/cpu.max", "max 100000\n");
  CHECK_FALSE(render::granted_cores(root / "two", root));
  write(root / "two/slice/cpu.max", "150000 100000\n");
  CHECK(render::granted_cores(root / "two/slice", root) == 2);
  write(root / "two/slice/job/cpu.max", "max 100000\n");
  CHECK(render::granted_cores(root / "two/slice/job", root) == 2);
  write(root / "two/slice/job/cpu.max", "20000 100000\n");
  CHECK(render::granted_cores(root / "two/slice/job", root) == 1);
  // The file of a container's own group is at the root, whatever the group is called outside.
  write(root / "cpu.max", "300000 100000\n");
  CHECK(render::granted_cores(root / "docker/0123", root) == 3);
  CHECK(render::granted_cores(root / "two/slice", root) == 2);

  write(root / "one/cpu.cfs_quota_us", "-1\n");
  write(root / "one/cpu.cfs_period_us", "100000\n");
  CHECK_FALSE(render::granted_cores(root / "one", root / "one"));
  write(root / "one/cpu.cfs_quota_us", "250000\n");
  CHECK(render::granted_cores(root / "one", root / "one") == 3);
  write(root / "one/cpu.cfs_period_us", "0\n");
  CHECK_FALSE(render::granted_cores(root / "one", root / "one"));
  for (const char* text : {"", "x", "100000", "-5 100000", "5 -100000"}) {
    write(root / "odd/cpu.max", text);
    CHECK_FALSE(render::granted_cores(root / "odd", root / "odd"));
  }
}

TEST_CASE("there is at least one processor") { CHECK(render::available_cores() >= 1); }
