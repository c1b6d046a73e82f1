#pragma once
#include <algorithm>
#include <cmath>

#include "engine/geometry/triangle.h"
#include "engine/math/bounds.h"
#include "engine/math/constants.h"
#include "engine/math/error_free.h"

namespace penumbra::accel {

/// A lower bound of where the ray enters the box, or +infinity if it misses [0, limit]. Conservative: it never misses a
/// box that holds something a shape's own test would find. A NaN (a ray in the plane of a face) counts as inside that
/// slab.
///
/// The interval is widened by 2γ(3) for the slab's own rounding (PBR section 6.1.2) and by 2γ(5) for that of the
/// triangle test, whose sheared vertices are as wrong as a ray shifted by that share of the distance. A triangle's t is
/// a mean of its vertices' distances along the ray's main axis and is rounded as the largest of them is, however close
/// the hit.
inline double enter(const math::Bounds& box, const geometry::PreparedRay& ray, double limit) {
  constexpr double widen = 1 + 2 * math::gamma(3) + 2 * math::gamma(5);
  double near = 0, far = limit, reach = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const bool backwards = std::signbit(ray.inverse[axis]);
    const double t0 = ((backwards ? box.upper[axis] : box.lower[axis]) - ray.origin[axis]) * ray.inverse[axis];
    const double t1 = ((backwards ? box.lower[axis] : box.upper[axis]) - ray.origin[axis]) * ray.inverse[axis] * widen;
    if (axis == ray.axis_z) reach = std::max(std::fabs(t0), std::fabs(t1));
    near = t0 > near ? t0 : near;
    far = t1 < far ? t1 : far;
  }
  const double rounding = math::gamma(16) * reach;
  return near <= far * widen + rounding ? near * (2 - widen) - rounding : math::infinity;
}

}  // namespace penumbra::accel
