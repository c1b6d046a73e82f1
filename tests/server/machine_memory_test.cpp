#include "server/cli/machine_memory.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>

#include "tests/server/fixture.h"

namespace {

constexpr std::size_t kibi = 1024;

class FakeMachine {
 public:
  FakeMachine& file(const std::string& path, const std::string& text) {
    const std::filesystem::path whole(folder_ / path);
    std::filesystem::create_directories(whole.parent_path());
    std::ofstream(whole) << text;
    return *this;
  }
  std::size_t memory() const { return penumbra::cli::machine_memory_bytes(folder_ / "."); }

 private:
  penumbra::test::TemporaryDirectory folder_;
};

}  // namespace

TEST_CASE("the memory of a machine is what its container leaves of it") {
  FakeMachine machine;
  CHECK(machine.memory() == 0);
  machine.file("proc/meminfo", "MemTotal:       1000 kB\nMemFree:  10 kB\n");
  CHECK(machine.memory() == 1000 * kibi);

  SUBCASE("version 2, the least of the group and those above it") {
    machine.file("proc/self/cgroup", "0::/pod/box\n").file("sys/fs/cgroup/pod/box/memory.max", "max\n");
    CHECK(machine.memory() == 1000 * kibi);
    machine.file("sys/fs/cgroup/pod/memory.max", "500000\n");
    CHECK(machine.memory() == 500'000);
    machine.file("sys/fs/cgroup/pod/box/memory.max", "400000\n");
    CHECK(machine.memory() == 400'000);
  }
  SUBCASE("version 2, seen from inside the container") {
    machine.file("proc/self/cgroup", "0::/\n").file("sys/fs/cgroup/memory.max", "300000\n");
    CHECK(machine.memory() == 300'000);
  }
  SUBCASE("version 1") {
    machine.file("proc/self/cgroup", "5:cpu,cpuacct:/x\n3:memory:/docker/ab\n1:name=systemd:/\n")
        .file("sys/fs/cgroup/memory/docker/ab/memory.limit_in_bytes", "200000\n");
    CHECK(machine.memory() == 200'000);
  }
  SUBCASE("version 1, where the path is the host's") {
    machine.file("proc/self/cgroup", "3:memory:/docker/ab\n")
        .file("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
    CHECK(machine.memory() == 1000 * kibi);
    machine.file("sys/fs/cgroup/memory/memory.limit_in_bytes", "100000\n");
    CHECK(machine.memory() == 100'000);
  }
}

TEST_CASE("this machine has memory") { CHECK(penumbra::cli::machine_memory_bytes() > 100u << 20); }
