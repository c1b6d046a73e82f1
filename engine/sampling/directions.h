#pragma once
#include <optional>

#include "engine/math/vec3.h"
#include "engine/sampling/patterns.h"

namespace penumbra::sampling {

using math::Vec3;

/// The directions in which a sphere is seen from outside it.
struct SphereCone {
  math::Frame frame;  // n towards the centre
  double distance, radius;
  double one_minus_cosine;  // of the cone's half angle
  double solid_angle;       // steradians
};
/// Nothing when `from` is inside the sphere.
std::optional<SphereCone> cone_of_sphere(const Vec3& from, const Vec3& center, double radius);
/// The point of the near side seen in a uniformly chosen direction of the cone, relative to where it is seen from.
Vec3 point_in_cone(const SphereCone& cone, const Point2& square);

/// A uniform direction of the whole sphere, unit.
Vec3 direction_on_sphere(const Point2& square);

/// A parallelogram light's rectangle seen from a point, sampled uniformly by solid angle. Ureña, Fajardo, King, "An
/// Area-Preserving Parametrization for Spherical Rectangles", EGSR 2013.
class SphericalRectangle {
 public:
  /// `edge_u` and `edge_v` must be perpendicular. Nothing when the rectangle is seen so small or so edge-on that the
  /// formula loses its digits.
  static std::optional<SphericalRectangle> seen_from(const Vec3& from, const Vec3& corner, const Vec3& edge_u,
                                                     const Vec3& edge_v);
  double solid_angle() const { return solid_angle_; }
  /// The point of the rectangle, relative to where it is seen from.
  Vec3 point(const Point2& square) const;

 private:
  Vec3 x_, y_, z_;
  double x0_, x1_, y0_, y1_, z0_;
  double b0_, b1_, k_, solid_angle_;
};

}  // namespace penumbra::sampling
