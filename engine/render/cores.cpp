#include "engine/render/cores.h"

#include <sched.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

namespace penumbra::render {
namespace {

/// Of one group: its share of a processor, or more than one.
std::optional<double> share(const std::filesystem::path& group) {
  double quota = 0, period = 0;
  if (std::ifstream both(group / "cpu.max"); both >> quota >> period && quota > 0 && period > 0) return quota / period;
  std::ifstream of_quota(group / "cpu.cfs_quota_us"), of_period(group / "cpu.cfs_period_us");
  if (of_quota >> quota && of_period >> period && quota > 0 && period > 0) return quota / period;
  return std::nullopt;
}

int cores_of_affinity() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) return std::max(1, CPU_COUNT(&allowed));
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace

std::optional<int> granted_cores(std::filesystem::path group, const std::filesystem::path& root) {
  std::optional<double> least;
  for (;; group = group.parent_path()) {
    // In a container the group's own folder is often mounted as the root, and its name leads nowhere.
    if (const std::optional<double> granted = share(group)) least = std::min(*granted, least.value_or(HUGE_VAL));
    if (group == root || group == group.parent_path()) break;
  }
  constexpr double most = 1 << 16;
  return least ? std::optional(static_cast<int>(std::ceil(std::min(*least, most)))) : std::nullopt;
}

int available_cores() {
  int cores = cores_of_affinity();
  // Lines are number:controllers:/group; version 2 names no controllers.
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    std::istringstream fields(line);
    std::string number, controllers, group;
    if (!std::getline(fields, number, ':') || !std::getline(fields, controllers, ':') || !std::getline(fields, group))
      continue;
    const bool is_of_cpu = ("," + controllers + ",").find(",cpu,") != std::string::npos;
    if (!controllers.empty() && !is_of_cpu) continue;
    const std::filesystem::path root = controllers.empty() ? "/sys/fs/cgroup" : "/sys/fs/cgroup/cpu";
    if (const auto granted = granted_cores(root / std::filesystem::path(group).relative_path(), root))
      cores = std::min(cores, std::max(1, *granted));
  }
  return cores;
}

}  // namespace penumbra::render
