#pragma once
#include <algorithm>
#include <cstdint>

#include "tests/bench/flat_scene.h"

namespace penumbra::bench {

/// Where a ray of a peer met the scene.
struct SurfaceHit {
  Vec3 position;
  Vec3 normal;          // geometric, outward, unit
  Vec3 shading_normal;  // unit; that of a smooth mesh is interpolated
  std::uint32_t material = 0;
  double size = 0;  // of the shape that was met
};

inline double largest_coordinate(const Vec3& v) { return math::max_component(math::abs(v)); }

/// The largest coordinate of a shape: single precision rounds by shares of it.
inline double size_of(const FlatSphere& s) { return largest_coordinate(s.center) + s.radius; }
/// Embree meets curves with a fourth of the precision of other shapes.
inline double size_of(const FlatCylinder& c) {
  return 4 * (std::max(largest_coordinate(c.from), largest_coordinate(c.to)) + c.radius);
}

/// The point of `triangle` with weights b1 and b2 of its second and third vertex.
SurfaceHit on_triangle(const FlatScene& flat, const FlatTriangle& triangle, double b1, double b2);

/// What was met in the space of the instance's mesh, in that of the world.
SurfaceHit placed(const FlatInstance& instance, const SurfaceHit& hit);

}  // namespace penumbra::bench
