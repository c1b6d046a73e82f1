#include "engine/geometry/quadrics.h"

#include <utility>

#include "engine/math/constants.h"

namespace penumbra::geometry {
namespace {

using math::abs;
using math::dot;
using math::gamma;
using math::length;

/// Where origin + t·d crosses a circle or sphere of radius r around the origin of f. `entry` ≤ `exit`, of either sign.
struct Chord {
  double entry, exit;
  double error;  // of whichever root lies near t = 0
};

/// A segment in the plane of a circle (or in space, for a sphere), relative to its middle.
struct CenterdSegment {
  Vec3 from, direction;
  double limit;
  double rounding;  // of coordinates
};

/// Whether the segment ends on the circle, within rounding: an end at the radius r.
bool ends_on(const CenterdSegment& s, double r) {
  return s.limit < math::infinity && std::fabs(length(s.from + s.direction * s.limit) - r) <= s.rounding;
}

/// The stable quadratic of Haines, Günther, Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection",
/// Ray Tracing Gems, chapter 7, with the discriminant factored into (r + |l|)(r − |l|). With `on_surface`, the segment
/// starts on the circle and t = 0 is one of the roots; where it ends there, t = limit is.
std::optional<Chord> chord(const CenterdSegment& s, double r, bool on_surface) {
  const Vec3 &f = s.from, &d = s.direction;
  const double a = dot(d, d);
  if (!(a > 0)) return std::nullopt;
  if (ends_on(s, r)) {
    const double slope = dot(f + d * s.limit, d), other = on_surface ? 0 : s.limit - 2 * slope / a;
    const double error = (s.rounding + gamma(16) * r) / std::sqrt(a);
    return slope > 0 ? Chord{std::min(other, s.limit), s.limit, error} : Chord{s.limit, math::infinity, error};
  }
  const double b = dot(f, d);
  if (on_surface) {
    const double other = -2 * b / a;
    return Chord{std::min(other, 0.0), std::max(other, 0.0), 0};
  }
  const Vec3 l = f - d * (b / a);
  const double distance = length(l);
  if (!(distance <= r)) return std::nullopt;
  const double root = std::sqrt(a * ((r + distance) * (r - distance)));
  const double q = -(b + std::copysign(root, b));
  const double size = length(f);
  // The root nearer to t = 0 cancels in (−b ∓ root)/a only close to the surface; elsewhere that form has one rounding
  // less.
  const bool is_close = root > 0.5 * std::fabs(b);
  double near_root = is_close ? (q != 0 ? (size + r) * (size - r) / q : 0) : (b > 0 ? root - b : -b - root) / a;
  double far_root = q / a;
  const double error = is_close && q != 0 ? gamma(8) * (size + r) * (size + r) / std::fabs(q) : 0;
  if (near_root > far_root) std::swap(near_root, far_root);
  return Chord{near_root, far_root, error};
}

/// What coordinates of a segment to something of this size around `middle` may be off.
double rounding_of(const Segment& segment, const Vec3& middle, double size) {
  if (!segment.has_end()) return segment.rounding;
  return segment.rounding + rounding_of_end(segment.origin, segment.direction, segment.limit) +
         gamma(16) * (math::taxicab(middle) + size);
}

Crossings between(const std::optional<Chord>& found, double limit) {
  Crossings result;
  if (!found) return result;
  if (found->entry > found->error && found->entry < limit) result.add(found->entry, 0);
  if (found->exit > found->error && found->exit < limit) result.add(found->exit, 0);
  return result;
}

Vec3 across(const Vec3& v, const Vec3& unit_axis) { return v - unit_axis * dot(v, unit_axis); }

/// The point at `radius` from the axis through `origin`, nearest to `near`.
SurfacePoint on_side(const Vec3& origin, const Vec3& axis, double radius, const Vec3& near) {
  const Vec3 offset = near - origin;
  const double along = dot(offset, axis);
  Vec3 outward = across(offset, axis);
  outward = across(outward, axis);  // once more: a long axis leaves a residue of the first projection
  SurfacePoint point;
  point.normal = point.shading_normal = math::normalize_or(outward, math::frame_around(axis).u);
  point.position = origin + axis * along + point.normal * radius;
  const double size = std::fabs(along) + radius;
  point.error = (abs(origin) + Vec3{size, size, size}) * gamma(12);
  return point;
}

math::Bounds widened(const Vec3& lower, const Vec3& upper) {
  const Vec3 margin = math::max(abs(lower), abs(upper)) * gamma(8);
  return {lower - margin, upper + margin};
}

}  // namespace

Crossings crossings(const SphereShape& sphere, const Segment& segment, SelfPart self) {
  const double rounding = rounding_of(segment, sphere.center, sphere.radius);
  return between(chord({segment.origin - sphere.center, segment.direction, segment.limit, rounding}, sphere.radius,
                       self.has_value()),
                 segment.limit);
}

Crossings crossings(const TubeShape& tube, const Segment& segment, SelfPart self) {
  const double rounding = rounding_of(segment, tube.point, tube.radius);
  const Vec3 from = across(segment.origin - tube.point, tube.axis), way = across(segment.direction, tube.axis);
  return between(chord({from, way, segment.limit, rounding}, tube.radius, self.has_value()), segment.limit);
}

namespace {

/// A segment and a cylinder, apart along the axis and across it.
struct CylinderMeeting {
  const CylinderShape& cylinder;
  const Segment& segment;
  SelfPart self;
  double z, dz;  // of the origin above the base, and of the direction
  double rounding;
  std::optional<Chord> side;

  CylinderMeeting(const CylinderShape& c, const Segment& s, SelfPart on)
      : cylinder(c),
        segment(s),
        self(on),
        z(dot(s.origin - c.base, c.axis)),
        dz(dot(s.direction, c.axis)),
        rounding(rounding_of(s, c.base, c.radius + c.height)),
        side(chord({across(s.origin - c.base, c.axis), across(s.direction, c.axis), s.limit, rounding}, c.radius,
                   on && *on == cylinder_side)) {}

  bool is_self(std::uint32_t part) const { return self && *self == part; }
  /// Where the plane of a cap is met: exactly at the origin or the end, if that lies on it.
  double at_cap(std::uint32_t part) const {
    const double level = part == cylinder_top ? cylinder.height : 0;
    if (is_self(part)) return 0;
    if (segment.has_end() && std::fabs(z + segment.limit * dz - level) <= rounding) return segment.limit;
    return (level - z) / dz;
  }
  void add(double t, double error, std::uint32_t part, Crossings& crossings) const {
    if (t > error && t < segment.limit && !(is_self(part) && t == 0)) crossings.add(t, part);
  }
  Crossings of_side_alone() const {
    Crossings result;
    if (!side) return result;
    for (const double t : {side->entry, side->exit}) {
      const double at = z + t * dz;
      if (at >= 0 && at <= cylinder.height) add(t, side->error, cylinder_side, result);
    }
    return result;
  }
  /// The solid is tube ∩ slab, so no ray can slip between side and cap.
  Crossings of_solid() const;
};

Crossings CylinderMeeting::of_solid() const {
  Crossings result;
  double entry = -math::infinity, exit = math::infinity;
  std::uint32_t entry_part = cylinder_side, exit_part = cylinder_side;
  double entry_error = 0, exit_error = 0;
  if (side) {
    entry = side->entry, exit = side->exit;
    entry_error = exit_error = side->error;
  } else {
    const Vec3 way = across(segment.direction, cylinder.axis);
    const double distance = length(across(segment.origin - cylinder.base, cylinder.axis));
    if (!(dot(way, way) == 0 && distance <= cylinder.radius)) return result;
  }
  if (dz != 0) {
    const double error = gamma(8) *
                         (dot(abs(segment.origin) + abs(cylinder.base), abs(cylinder.axis)) + cylinder.height) /
                         std::fabs(dz);
    const std::uint32_t first = dz > 0 ? cylinder_base : cylinder_top, last = dz > 0 ? cylinder_top : cylinder_base;
    if (const double t = at_cap(first); t > entry) entry = t, entry_part = first, entry_error = error;
    if (const double t = at_cap(last); t < exit) exit = t, exit_part = last, exit_error = error;
  } else if (z < 0 || z > cylinder.height) {
    return result;
  }
  if (!(entry <= exit)) return result;
  add(entry, entry_error, entry_part, result);
  add(exit, exit_error, exit_part, result);
  return result;
}

}  // namespace

Crossings crossings(const CylinderShape& cylinder, const Segment& segment, SelfPart self) {
  const CylinderMeeting meeting(cylinder, segment, self);
  return cylinder.caps ? meeting.of_solid() : meeting.of_side_alone();
}

Crossings crossings(const PlaneShape& plane, const Segment& segment, SelfPart self) {
  Crossings result;
  const double slope = dot(plane.normal, segment.direction);
  if (self || slope == 0) return result;
  const double height = dot(plane.normal, plane.point - segment.origin), t = height / slope;
  if (segment.has_end() && std::fabs(height - slope * segment.limit) <= rounding_of(segment, plane.point, 0))
    return result;
  const double error = gamma(8) * dot(abs(plane.normal), abs(plane.point) + abs(segment.origin)) / std::fabs(slope);
  if (t > error && t < segment.limit) result.add(t, 0);
  return result;
}

SurfacePoint surface_at(const SphereShape& sphere, const Vec3& near, std::uint32_t) {
  SurfacePoint point;
  point.normal = point.shading_normal = math::normalize_or(near - sphere.center, {0, 0, 1});
  point.position = sphere.center + point.normal * sphere.radius;
  point.error = (abs(sphere.center) + Vec3{sphere.radius, sphere.radius, sphere.radius}) * gamma(8);
  return point;
}

SurfacePoint surface_at(const TubeShape& tube, const Vec3& near, std::uint32_t) {
  return on_side(tube.point, tube.axis, tube.radius, near);
}

SurfacePoint surface_at(const CylinderShape& cylinder, const Vec3& near, std::uint32_t part) {
  if (part == cylinder_side) return on_side(cylinder.base, cylinder.axis, cylinder.radius, near);
  const Vec3 center = part == cylinder_top ? cylinder.base + cylinder.axis * cylinder.height : cylinder.base;
  SurfacePoint point = surface_at(PlaneShape{center, part == cylinder_top ? cylinder.axis : -cylinder.axis}, near, 0);
  const double size = cylinder.height + cylinder.radius;
  point.error += Vec3{size, size, size} * gamma(8);
  return point;
}

SurfacePoint surface_at(const PlaneShape& plane, const Vec3& near, std::uint32_t) {
  SurfacePoint point;
  point.normal = point.shading_normal = plane.normal;
  point.position = near - plane.normal * dot(plane.normal, near - plane.point);
  const double size = dot(abs(plane.normal), abs(near) + abs(plane.point));
  point.error = (abs(near) + Vec3{size, size, size}) * gamma(10);
  return point;
}

std::optional<math::Bounds> bounds_of(const SphereShape& sphere) {
  const Vec3 r{sphere.radius, sphere.radius, sphere.radius};
  return widened(sphere.center - r, sphere.center + r);
}

std::optional<math::Bounds> bounds_of(const TubeShape&) { return std::nullopt; }

std::optional<math::Bounds> bounds_of(const CylinderShape& cylinder) {
  const Vec3 top = cylinder.base + cylinder.axis * cylinder.height;
  const Vec3& n = cylinder.axis;
  const Vec3 r =
      Vec3{std::sqrt(n.y * n.y + n.z * n.z), std::sqrt(n.z * n.z + n.x * n.x), std::sqrt(n.x * n.x + n.y * n.y)} *
      cylinder.radius;
  return widened(math::min(cylinder.base, top) - r, math::max(cylinder.base, top) + r);
}

std::optional<math::Bounds> bounds_of(const PlaneShape&) { return std::nullopt; }

}  // namespace penumbra::geometry
