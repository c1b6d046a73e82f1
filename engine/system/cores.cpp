#include "engine/system/cores.h"

#include <sched.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <thread>

#include "engine/math/constants.h"
#include "engine/system/control_groups.h"

namespace penumbra::system {
namespace {

/// Processors' worth of time that one control group grants; without end where it has no limit.
double granted_by(const std::string& group) {
  double quota = 0, period = 0;
  if (std::ifstream both(group + "/cpu.max"); both >> quota >> period && quota > 0 && period > 0) return quota / period;
  std::ifstream of_quota(group + "/cpu.cfs_quota_us"), of_period(group + "/cpu.cfs_period_us");
  if (of_quota >> quota && of_period >> period && quota > 0 && period > 0) return quota / period;
  return math::infinity;
}

int cores_of_affinity() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) return CPU_COUNT(&allowed);
  return static_cast<int>(std::thread::hardware_concurrency());
}

}  // namespace

int available_cores(const std::string& root) {
  double cores = cores_of_affinity();
  for_each_control_group(root, "cpu",
                         [&](const std::string& group) { cores = std::min(cores, std::ceil(granted_by(group))); });
  return std::max(1, static_cast<int>(cores));
}

}  // namespace penumbra::system
