#pragma once
#include <cstdint>
#include <map>
#include <string>

namespace penumbra::render {

struct RayCounts {
  std::uint64_t camera = 0, shadow = 0, reflection = 0, transmission = 0;
};

/// What a finished render reports. `skipped` counts, by name, the work that was proven unnecessary.
struct Stats {
  double build_s = 0, render_s = 0, encode_s = 0;
  RayCounts rays;
  std::map<std::string, std::uint64_t> skipped;
  double estimated_error = 0;  // RMSE as the contract defines it, estimated from the samples
};

}  // namespace penumbra::render
