#pragma once
#include <limits>

#include "engine/math/vec3.h"

namespace penumbra::math {

/// An axis-aligned box, closed on both sides. The default is empty (lower > upper).
struct Bounds {
  Vec3 lower{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
             std::numeric_limits<double>::infinity()};
  Vec3 upper{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
             -std::numeric_limits<double>::infinity()};

  bool is_empty() const { return !(lower.x <= upper.x && lower.y <= upper.y && lower.z <= upper.z); }
  Vec3 extent() const { return upper - lower; }
  Vec3 centre() const { return lower * 0.5 + upper * 0.5; }
  /// Half the surface area: what the surface area heuristic needs. 0 when empty.
  double half_area() const {
    if (is_empty()) return 0;
    const Vec3 e = extent();
    return e.x * e.y + e.y * e.z + e.z * e.x;
  }
  void include(const Vec3& p) { lower = min(lower, p), upper = max(upper, p); }
  void include(const Bounds& b) { lower = min(lower, b.lower), upper = max(upper, b.upper); }
};

}  // namespace penumbra::math
