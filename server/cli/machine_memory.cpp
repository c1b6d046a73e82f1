#include "server/cli/machine_memory.h"

#include <algorithm>
#include <fstream>
#include <limits>

#include "engine/system/control_groups.h"

namespace penumbra::cli {

namespace {

constexpr std::size_t unlimited = std::numeric_limits<std::size_t>::max();

std::size_t total_bytes(const std::string& root) {
  std::ifstream file(root + "/proc/meminfo");
  std::string name;
  std::size_t kibibytes = 0;
  while (file >> name >> kibibytes) {
    if (name == "MemTotal:") return kibibytes << 10;
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return unlimited;
}

}  // namespace

std::size_t machine_memory_bytes(const std::string& root) {
  std::size_t least = total_bytes(root);
  system::for_each_control_group(root, "memory", [&](const std::string& group) {
    // One that is no number ("max") limits nothing.
    for (const char* name : {"/memory.max", "/memory.limit_in_bytes"}) {
      std::size_t limit = 0;
      if (std::ifstream(group + name) >> limit) least = std::min(least, limit);
    }
  });
  return least == unlimited ? 0 : least;
}

}  // namespace penumbra::cli
