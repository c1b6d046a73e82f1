#pragma once
#include <array>

#include "engine/geometry/quadrics.h"
#include "engine/geometry/triangle.h"
#include "engine/math/bounds.h"

namespace penumbra::accel {

using math::Vec3;

/// A convex region: what is inside a few planes and a box. Tests are conservative, rounding included: what one rejects
/// is apart from the region.
class HalfSpaces {
 public:
  static constexpr int capacity = 7;

  HalfSpaces() = default;
  /// Planes are given relative to `base`; `reach` bounds the coordinates they were computed from.
  HalfSpaces(const Vec3& base, double reach, const math::Bounds& bounds);

  /// Inside is outward·(x − base) ≤ offset, within a few roundings of coordinates below `reach`.
  void add(const Vec3& outward, double offset);
  /// As `add`; and what lies wholly before this plane is worth knowing (see FloatPlanes::far).
  void add_far(const Vec3& outward, double offset);
  /// A plane through `base` that everything of interest rises above along `up`: what does not rise above it by more
  /// than rounding is outside.
  void add_floor(const Vec3& up);

  bool miss(const math::Bounds& box) const;
  bool miss(const geometry::TriangleVertices& triangle) const;
  bool miss(const geometry::SphereShape& sphere) const;

  /// The same in single precision, of coordinates relative to `origin`: outside where outward·x > offset, beyond
  /// `slack`, or outside [lower, upper]. Rows are WideTree::Node's: lower x, y, z, upper x, y, z.
  struct FloatPlanes {
    struct Plane {
      float outward[3], offset, slack, length;
      int nearest_row[3];  // of the corner of a box that is least outside
    };
    Plane plane[capacity];
    int count, far;  // far: which is the far plane, or −1
    float lower[3], upper[3];
  };
  FloatPlanes in_single_precision(const Vec3& origin) const;

 private:
  bool is_apart(const Vec3& lower, const Vec3& upper) const;

  struct Side {
    Vec3 outward, size;  // size = |outward|
    double offset, slack;
  };
  Vec3 base_;
  double reach_ = 0;
  math::Bounds bounds_;
  std::array<Side, capacity> sides_;
  int count_ = 0, far_ = -1;
};

}  // namespace penumbra::accel
