#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "engine/accel/half_spaces.h"
#include "engine/accel/world.h"
#include "engine/geometry/ray.h"
#include "engine/math/bounds.h"

namespace penumbra::shading::shadows {

using accel::HalfSpaces;
using accel::Placement;
using math::Vec3;

/// Where a point sees things from: moved off its surface by a few roundings.
struct Apex {
  Vec3 place;
  double rounding = 0;  // of its coordinates: what lies that near to it, or in one plane with it, may touch its surface
};

/// The convex hull of a point and a planar convex quadrilateral seen from it, or the infinite pyramid through four
/// directions. Tests are conservative: what they reject no segment from the apex into the quadrilateral can cross,
/// rounding included. Not to be shared between threads.
class Shaft {
 public:
  /// `corners` in order around the quadrilateral: points, or directions when `is_infinite`. `floor`, if not zero, is
  /// the normal of a plane through the apex: only segments that rise above it matter.
  Shaft(const Apex& apex, const std::array<Vec3, 4>& corners, bool is_infinite, const Vec3& floor = {});

  bool misses(const math::Bounds& box) const { return half_spaces().miss(box); }
  bool misses(const geometry::TriangleVertices& triangle) const;
  bool misses(const geometry::SphereShape& sphere) const { return half_spaces().miss(sphere); }
  bool misses(const geometry::CylinderShape& cylinder) const { return half_spaces().miss(cylinder); }
  bool misses(const geometry::PlaneShape& plane) const;
  bool misses(const geometry::TubeShape& tube) const;
  /// Every segment from the apex into the quadrilateral crosses the triangle.
  bool is_covered_by(const geometry::TriangleVertices& triangle) const;

  /// Made when first asked for.
  const HalfSpaces& half_spaces() const {
    if (!half_spaces_) half_spaces_ = accel::pyramid(apex_, corners_, is_infinite_, floor_);
    return *half_spaces_;
  }

  Shaft in_space_of(const Placement& placement) const;
  const Vec3& apex() const { return apex_; }
  /// From the apex to the corners (or the corner directions).
  const std::array<Vec3, 4>& edges() const { return edges_; }
  bool is_infinite() const { return is_infinite_; }

 private:
  Vec3 apex_;
  double rounding_;
  std::array<Vec3, 4> corners_, edges_;
  Vec3 floor_;
  bool is_infinite_;
  mutable std::optional<HalfSpaces> half_spaces_;
};

}  // namespace penumbra::shading::shadows
