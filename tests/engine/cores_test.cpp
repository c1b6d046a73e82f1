// How many processors control groups leave: files as Linux has them, in a folder of our own.
#include "engine/system/cores.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/support/temporary_directory.h"

using namespace penumbra;

namespace {

class Machine {
 public:
  void write(const std::string& file, const std::string& text) {
    const std::filesystem::path path = folder_ / file;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
  }
  int cores() const { return system::available_cores(folder_ / "."); }

 private:
  test::TemporaryDirectory folder_;
};

}  // namespace

TEST_CASE("processors are those that control groups grant, of version 2") {
  const int all = system::available_cores();
  REQUIRE(all >= 1);
  Machine machine;
  CHECK(machine.cores() == all);
  machine.write("proc/self/cgroup", "0::/slice/job\n");
  CHECK(machine.cores() == all);
  machine.write("sys/fs/cgroup/slice/job/cpu.max", "max 100000\n");
  machine.write("sys/fs/cgroup/slice/cpu.max", "100000000 100000\n");
  CHECK(machine.cores() == all);
  machine.write("sys/fs/cgroup/slice/cpu.max", "100000 100000\n");
  CHECK(machine.cores() == 1);
  machine.write("sys/fs/cgroup/slice/cpu.max", "1000 100000\n");
  CHECK(machine.cores() == 1);
  machine.write("sys/fs/cgroup/slice/cpu.max", "110000 100000\n");
  CHECK(machine.cores() == std::min(all, 2));
  for (const char* odd : {"", "x", "100000", "-5 100000", "5 -100000", "5 0"}) {
    machine.write("sys/fs/cgroup/slice/cpu.max", odd);
    CHECK(machine.cores() == all);
  }
  // The file of a container's own group is at the top, whatever the group is called outside.
  machine.write("sys/fs/cgroup/cpu.max", "50000 100000\n");
  CHECK(machine.cores() == 1);
}

TEST_CASE("processors are those that control groups grant, of version 1") {
  const int all = system::available_cores();
  Machine machine;
  machine.write("proc/self/cgroup", "3:memory:/job\n2:cpuset:/job\n1:cpu,cpuacct:/job\n");
  machine.write("sys/fs/cgroup/cpu/job/cpu.cfs_period_us", "100000\n");
  machine.write("sys/fs/cgroup/cpu/job/cpu.cfs_quota_us", "-1\n");
  CHECK(machine.cores() == all);
  machine.write("sys/fs/cgroup/cpu/job/cpu.cfs_quota_us", "60000\n");
  CHECK(machine.cores() == 1);
}
