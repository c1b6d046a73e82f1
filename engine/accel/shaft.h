#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "engine/accel/world.h"
#include "engine/geometry/ray.h"
#include "engine/math/bounds.h"

namespace penumbra::accel {

/// The convex hull of a point and a planar convex quadrilateral seen from it, or the infinite pyramid through four
/// directions. Tests are conservative: what they reject no segment from the apex into the quadrilateral can cross,
/// rounding included.
class Shaft {
 public:
  /// `corners` in order around the quadrilateral: points, or directions when `is_infinite`. `floor`, if not zero, is the
  /// normal of a plane through the apex that all corners are above.
  Shaft(const Vec3& apex, const std::array<Vec3, 4>& corners, bool is_infinite, const Vec3& floor = {});

  bool misses(const math::Bounds& box) const;
  bool misses(const geometry::TriangleVertices& triangle) const;
  bool misses(const geometry::SphereShape& sphere) const;
  bool misses(const geometry::PlaneShape& plane) const;
  bool misses(const geometry::TubeShape& tube) const;
  /// Every segment from the apex into the quadrilateral crosses the triangle.
  bool is_covered_by(const geometry::TriangleVertices& triangle) const;

  /// The same test for boxes in single precision, of coordinates relative to `origin`: outside where outward·x > offset
  /// at the box's nearest corner, beyond `slack`, or outside [lower, upper]. Rows are WideTree::Node's: lower x, y, z,
  /// upper x, y, z.
  struct BoxPlanes {
    struct Plane {
      float outward[3], offset, slack, length;
      int nearest_row[3];
    };
    Plane plane[7];
    int count, far;  // far: which is the far plane, or −1
    float lower[3], upper[3];
  };
  BoxPlanes box_planes(const Vec3& origin) const;

  Shaft in_space_of(const Placement& placement) const;
  const Vec3& apex() const { return apex_; }
  /// From the apex to the corners (or the corner directions).
  const std::array<Vec3, 4>& edges() const { return edges_; }
  bool is_infinite() const { return is_infinite_; }

 private:
  bool is_apart(const Vec3& lower, const Vec3& upper) const;

  struct Side {
    Vec3 outward, size;  // outward·(x − apex) ≤ offset inside; size = |outward|
    double offset, slack;
  };
  Vec3 apex_;
  std::array<Vec3, 4> corners_, edges_;
  Vec3 floor_;
  bool is_infinite_;
  std::array<Side, 7> sides_;
  int side_count_;
  math::Bounds bounds_;
};

}  // namespace penumbra::accel
