#pragma once

#include "engine/math/constants.h"
#include "engine/math/vec3.h"

namespace penumbra::math {

/// An axis-aligned box, closed on both sides. The default is empty (lower > upper).
struct Bounds {
  Vec3 lower{math::infinity, math::infinity, math::infinity};
  Vec3 upper{-math::infinity, -math::infinity, -math::infinity};

  bool is_empty() const { return !(lower.x <= upper.x && lower.y <= upper.y && lower.z <= upper.z); }
  Vec3 extent() const { return upper - lower; }
  Vec3 center() const { return lower * 0.5 + upper * 0.5; }
  void include(const Vec3& p) { lower = min(lower, p), upper = max(upper, p); }
  void include(const Bounds& b) { lower = min(lower, b.lower), upper = max(upper, b.upper); }
};

}  // namespace penumbra::math
