#include "engine/geometry/quadrics.h"

#include <utility>

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

/// The stable quadratic of Haines, Günther, Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection",
/// Ray Tracing Gems, chapter 7, with the discriminant factored into (r + |l|)(r − |l|). f and d are in the plane of the
/// circle (or in space, for a sphere); with `on_surface`, f lies on it and t = 0 is one of the roots.
std::optional<Chord> chord(const Vec3& f, const Vec3& d, double r, bool on_surface) {
  const double a = dot(d, d);
  if (!(a > 0)) return std::nullopt;
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

Crossings positive(const std::optional<Chord>& found) {
  Crossings result;
  if (!found) return result;
  if (found->entry > found->error) result.add(found->entry, 0);
  if (found->exit > found->error) result.add(found->exit, 0);
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
  point.normal = point.shading_normal = math::normalize(outward);
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

Crossings crossings(const SphereShape& sphere, const Vec3& origin, const Vec3& direction, SelfPart self) {
  return positive(chord(origin - sphere.center, direction, sphere.radius, self.has_value()));
}

Crossings crossings(const TubeShape& tube, const Vec3& origin, const Vec3& direction, SelfPart self) {
  const Vec3 f = origin - tube.point;
  return positive(chord(across(f, tube.axis), across(direction, tube.axis), tube.radius, self.has_value()));
}

Crossings crossings(const CylinderShape& cylinder, const Vec3& origin, const Vec3& direction, SelfPart self) {
  const Vec3 f = origin - cylinder.base;
  const double z = dot(f, cylinder.axis), dz = dot(direction, cylinder.axis);
  const Vec3 f2 = across(f, cylinder.axis), d2 = across(direction, cylinder.axis);
  const bool on_side_itself = self && *self == cylinder_side;
  const std::optional<Chord> side = chord(f2, d2, cylinder.radius, on_side_itself);
  Crossings result;
  if (!cylinder.caps) {
    if (!side) return result;
    for (const double t : {side->entry, side->exit}) {
      const double at = z + t * dz;
      if (t > side->error && at >= 0 && at <= cylinder.height) result.add(t, cylinder_side);
    }
    return result;
  }
  // With caps: the solid is tube ∩ slab, so no ray can slip between side and cap.
  double entry = -HUGE_VAL, exit = HUGE_VAL;
  std::uint32_t entry_part = cylinder_side, exit_part = cylinder_side;
  double entry_error = 0, exit_error = 0;
  if (side) {
    entry = side->entry, exit = side->exit;
    entry_error = exit_error = side->error;
  } else if (!(dot(d2, d2) == 0 && length(f2) <= cylinder.radius)) {
    return result;
  }
  if (dz != 0) {
    const double base = self && *self == cylinder_base ? 0 : -z / dz;
    const double top = self && *self == cylinder_top ? 0 : (cylinder.height - z) / dz;
    const double error =
        gamma(8) * (dot(abs(origin) + abs(cylinder.base), abs(cylinder.axis)) + cylinder.height) / std::fabs(dz);
    const bool up = dz > 0;
    if (const double t = up ? base : top; t > entry)
      entry = t, entry_part = up ? cylinder_base : cylinder_top, entry_error = error;
    if (const double t = up ? top : base; t < exit)
      exit = t, exit_part = up ? cylinder_top : cylinder_base, exit_error = error;
  } else if (z < 0 || z > cylinder.height) {
    return result;
  }
  if (!(entry <= exit)) return result;
  const auto is_origin = [&](std::uint32_t part, double t) { return self && *self == part && t == 0; };
  if (entry > entry_error && !is_origin(entry_part, entry)) result.add(entry, entry_part);
  if (exit > exit_error && !is_origin(exit_part, exit)) result.add(exit, exit_part);
  return result;
}

Crossings crossings(const PlaneShape& plane, const Vec3& origin, const Vec3& direction, SelfPart self) {
  Crossings result;
  const double slope = dot(plane.normal, direction);
  if (self || slope == 0) return result;
  const double t = dot(plane.normal, plane.point - origin) / slope;
  const double error = gamma(8) * dot(abs(plane.normal), abs(plane.point) + abs(origin)) / std::fabs(slope);
  if (t > error) result.add(t, 0);
  return result;
}

SurfacePoint surface_at(const SphereShape& sphere, const Vec3& near, std::uint32_t) {
  SurfacePoint point;
  point.normal = point.shading_normal = math::normalize(near - sphere.center);
  point.position = sphere.center + point.normal * sphere.radius;
  point.error = (abs(sphere.center) + Vec3{sphere.radius, sphere.radius, sphere.radius}) * gamma(8);
  return point;
}

SurfacePoint surface_at(const TubeShape& tube, const Vec3& near, std::uint32_t) {
  return on_side(tube.point, tube.axis, tube.radius, near);
}

SurfacePoint surface_at(const CylinderShape& cylinder, const Vec3& near, std::uint32_t part) {
  if (part == cylinder_side) return on_side(cylinder.base, cylinder.axis, cylinder.radius, near);
  const Vec3 centre = part == cylinder_top ? cylinder.base + cylinder.axis * cylinder.height : cylinder.base;
  SurfacePoint point = surface_at(PlaneShape{centre, part == cylinder_top ? cylinder.axis : -cylinder.axis}, near, 0);
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
