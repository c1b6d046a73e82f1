#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "api/job_request.h"
#include "engine/render/render.h"

namespace penumbra::test {

inline render::Picture render(const api::JobRequest& job, const render::Switches& switches = {}) {
  system::Pool pool(2);
  render::Control control;
  auto picture = render::render(job.scene, job.options, pool, control, switches);
  REQUIRE(picture);
  return std::move(*picture);
}

/// Everything, or shadows by a ray a sample alone.
inline render::Switches with_candidates(bool use_candidates) {
  render::Switches switches;
  switches.shadow_candidates = switches.light_cells = use_candidates;
  return switches;
}

/// Root-mean-square difference of values clamped to [0, 1], as the contract defines the error.
inline double rmse(const render::Film::Values& a, const render::Film::Values& b) {
  REQUIRE(a.size() == b.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = std::clamp<double>(a[i], 0, 1) - std::clamp<double>(b[i], 0, 1);
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(a.size()));
}

}  // namespace penumbra::test
