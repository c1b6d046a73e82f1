#pragma once
#include <array>

#include "engine/geometry/quadrics.h"
#include "engine/geometry/triangle.h"
#include "engine/math/bounds.h"
#include "engine/math/error_free.h"

namespace penumbra::accel {

using math::Vec3;

/// A convex region: what is inside a few planes and a box. Tests are conservative, rounding included: what one rejects
/// is apart from the region.
class HalfSpaces {
 public:
  static constexpr int capacity = 7, limit_capacity = 4;

  HalfSpaces() = default;
  /// Planes are given relative to `base`; `reach` bounds the coordinates they were computed from.
  HalfSpaces(const Vec3& base, double reach, const math::Bounds& bounds);

  /// Inside is outward·(x − base) ≤ offset, within a few roundings of coordinates below `reach`.
  void add(const Vec3& outward, double offset);
  /// A plane that it is worth knowing to lie wholly inside of: it rejects nothing.
  void add_limit(const Vec3& outward, double offset);
  /// A plane through `base` that everything of interest rises above along `up`: what does not rise above it by more
  /// than rounding – of coordinates below `nearby`, and of a triangle's own – is outside.
  void add_floor(const Vec3& up, double nearby);

  bool miss(const math::Bounds& box) const;
  bool miss(const geometry::TriangleVertices& triangle) const;
  bool miss(const geometry::SphereShape& sphere) const;
  bool miss(const geometry::CylinderShape& cylinder) const;
  /// For certain.
  bool is_within_limits(const geometry::TriangleVertices& triangle) const;

  /// The same in single precision, of coordinates relative to `origin`: outside where outward·x > offset, beyond
  /// `slack` and `rounding`, or outside [lower, upper]. Rows are WideTree::Node's: lower x, y, z, upper x, y, z.
  struct FloatPlanes {
    struct Plane {
      float outward[3], offset, slack, length;
      float rounding;      // of a value, for each unit of the largest coordinate
      int nearest_row[3];  // of the corner of a box that is least outside; the one across is most
    };
    Plane plane[capacity], limit[limit_capacity];
    int count, limit_count;
    float lower[3], upper[3];
  };
  FloatPlanes in_single_precision(const Vec3& origin) const;

 private:
  bool is_apart(const Vec3& lower, const Vec3& upper) const;

  struct Side {
    Vec3 outward, size;  // size = |outward|
    double offset, slack;
    double own_slack = math::gamma(32);  // for each unit of a triangle's coordinates
  };
  Side side(const Vec3& outward, double offset) const;
  FloatPlanes::Plane in_single_precision(const Side& side, const Vec3& base) const;

  Vec3 base_;
  double reach_ = 0;
  math::Bounds bounds_;
  std::array<Side, capacity> sides_;
  std::array<Side, limit_capacity> limits_;
  int count_ = 0, limit_count_ = 0;
};

/// The hull of a point and a planar convex quadrilateral seen from it, or the infinite pyramid through four directions.
/// `corners` in order around the quadrilateral: points, or directions when `is_infinite`. `floor`, if not zero, is the
/// normal of a plane through the apex: only what rises above it is inside. What lies before the quadrilateral is within
/// the limits.
HalfSpaces pyramid(const Vec3& apex, const std::array<Vec3, 4>& corners, bool is_infinite, const Vec3& floor = {});

}  // namespace penumbra::accel
