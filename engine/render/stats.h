#pragma once
#include <cstdint>
#include <map>
#include <string>

#include "engine/shading/counters.h"

namespace penumbra::render {

/// What a finished render reports. `skipped` counts, by name, the work that was proven unnecessary.
struct Stats {
  double build_s = 0, render_s = 0, encode_s = 0;
  shading::RayCounts rays;
  std::map<std::string, std::uint64_t> skipped;
  double estimated_error = 0;  // RMSE as the contract defines it, estimated from the samples
};

}  // namespace penumbra::render
