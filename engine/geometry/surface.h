#pragma once
#include <cassert>
#include <cstdint>

#include "engine/geometry/ray.h"
#include "engine/math/error_free.h"
#include "engine/math/vec3.h"

namespace penumbra::geometry {

/// Where a ray meets a surface.
struct SurfacePoint {
  Vec3 position;
  Vec3 error;           // bounds, per coordinate, how far `position` is off the surface
  Vec3 normal;          // geometric, unit, outward (counter-clockwise winding)
  Vec3 shading_normal;  // unit; the interpolated one of a smooth mesh, else `normal`
};

/// The crossings of a closed convex surface, which are two at most, in ascending order of t; `part` as in SurfaceId.
struct Crossings {
  static constexpr int capacity = 2;
  int count = 0;
  double t[capacity]{};
  std::uint32_t part[capacity]{};

  void add(double distance, std::uint32_t which) {
    assert(count < capacity);
    t[count] = distance, part[count] = which, ++count;
  }
};

/// The nearest representable start for a ray that leaves `at` towards `direction`: moved along the normal, to the side
/// the direction points to, by no more than the position's error bound – so the origin lies on that side of the
/// surface. Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., section 6.8.6.
inline Vec3 leave_surface(const SurfacePoint& at, const Vec3& direction) {
  const double side = math::dot(direction, at.normal) < 0 ? -1.0 : 1.0;
  const double distance = math::dot(math::abs(at.normal), at.error);
  const Vec3 offset = at.normal * (side * distance);
  Vec3 start = at.position + offset;
  for (int axis = 0; axis < 3; ++axis) {
    if (offset[axis] == 0) continue;
    start[axis] = offset[axis] > 0 ? math::next_up(start[axis]) : math::next_down(start[axis]);
  }
  return start;
}

}  // namespace penumbra::geometry
