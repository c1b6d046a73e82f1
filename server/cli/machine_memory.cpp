#include "server/cli/machine_memory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <string_view>

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

/// The least limit in the files of this name from `path` up to `top`. One that does not exist ("max") limits nothing; a
/// path the container does not see is skipped.
std::size_t least_limit(const std::string& top, std::string path, const std::string& file_name) {
  const auto file_in = [&](const std::string& folder) {
    return std::string(top).append(folder).append("/").append(file_name);
  };
  std::size_t least = unlimited;
  while (true) {
    std::size_t limit = 0;
    if (std::ifstream(file_in(path)) >> limit) least = std::min(least, limit);
    if (path.empty()) return least;
    path.erase(std::min(path.rfind('/'), path.size()));
  }
}

}  // namespace

std::size_t machine_memory_bytes(const std::string& root) {
  std::size_t least = total_bytes(root);
  std::ifstream groups(root + "/proc/self/cgroup");
  // Lines of hierarchy:controllers:path; version 2 has the hierarchy 0 and no controllers.
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    std::string path = line.substr(second + 1);
    if (path == "/") path.clear();
    const std::string mounts = root + "/sys/fs/cgroup";
    if (controllers == ",,")
      least = std::min(least, least_limit(mounts, path, "memory.max"));
    else if (controllers.find(",memory,") != std::string::npos)
      least = std::min(least, least_limit(mounts + "/memory", path, "memory.limit_in_bytes"));
  }
  return least == unlimited ? 0 : least;
}

}  // namespace penumbra::cli
