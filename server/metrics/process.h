#pragma once
#include <optional>

namespace penumbra::metrics {

/// What the system says of this process.
struct Process {
  double resident_bytes = 0, cpu_s = 0, start_time_s = 0;  // the last since the epoch
  double open_descriptors = 0, max_descriptors = 0;
};

/// Nothing where /proc cannot be read.
std::optional<Process> this_process();

}  // namespace penumbra::metrics
