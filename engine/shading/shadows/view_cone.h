#pragma once
#include <cmath>

#include "engine/math/constants.h"
#include "engine/math/error_free.h"
#include "engine/math/vec3.h"

namespace penumbra::shading::shadows {

using math::Vec3;

/// The segments from a point into something round: whether a sphere hides all of it, or none. An angle is held by its
/// cosine and sine; tests are conservative, rounding included.
class ViewCone {
 public:
  ViewCone() = default;  ///< Of which nothing is known: no sphere covers it, none misses it.
  /// `axis` leads to the middle of a ball of this radius; or is a direction that all directions of interest, which lead
  /// on without end, are within `radius` of.
  static ViewCone around(const Vec3& axis, double radius, bool is_infinite) {
    const double length = math::length(axis);
    if (!(length > radius * (1 + math::gamma(64)))) return {};
    return {axis * (1 / length), radius / length, is_infinite ? math::infinity : length - radius};
  }

  /// Every segment crosses the sphere with this center, relative to the point.
  bool is_covered_by(const Vec3& center, double radius) const {
    const double squared = math::dot(center, center), r2 = radius * radius;
    if (!(radius * (1 - margin) > sine_ * std::sqrt(squared)) || !(squared > r2 * (1 + margin))) return false;
    // The sphere's tangent circle, and what is nearer, must be on this side of all ends.
    const double along = math::dot(axis_, center);
    if (!(along > 0) || !(squared < before())) return false;
    // angle(axis, center) + cone's angle ≤ sphere's angle, by the cosine of their difference
    return along * (1 - margin) > std::sqrt(squared - r2) * cosine_ + radius * sine_;
  }

  /// No segment meets the sphere.
  bool misses(const Vec3& center, double radius) const {
    const double squared = math::dot(center, center), r2 = radius * radius;
    if (!is_known() || !(squared > r2 * (1 + margin))) return false;
    // angle(axis, center) ≥ cone's angle + sphere's angle
    const double along = math::dot(axis_, center), both = std::sqrt(squared - r2) * cosine_ - radius * sine_;
    return along < both - margin * std::sqrt(squared);
  }

  // What the tests are made of, for SIMD.
  static constexpr double margin = 0x1p-40;
  bool is_known() const { return sine_ <= 1; }
  const Vec3& axis() const { return axis_; }
  double sine() const { return sine_; }  // of the half-angle
  double cosine() const { return cosine_; }
  double before() const { return nearest_ * nearest_ * (1 - margin); }  // the square of what all segments go beyond

 private:
  ViewCone(const Vec3& axis, double sine, double nearest)
      : axis_(axis), sine_(sine), cosine_(std::sqrt(1 - sine * sine)), nearest_(nearest) {}
  Vec3 axis_;
  double sine_ = 2;  // of the half-angle; 2: nothing is that wide
  double cosine_ = 0;
  double nearest_ = 0;  // the least length of a segment
};

}  // namespace penumbra::shading::shadows
