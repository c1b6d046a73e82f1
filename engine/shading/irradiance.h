#pragma once
#include <array>

#include "engine/math/elementary.h"
#include "engine/math/vec3.h"

namespace penumbra::shading {

using math::Vec3;

/// A convex polygon of few corners, in order.
struct SmallPolygon {
  std::array<Vec3, 8> corners;
  std::size_t count = 0;
  void add(const Vec3& corner) { corners[count++] = corner; }
};

/// What of a polygon is on the side of `n`, seen from the origin.
inline SmallPolygon clipped(const SmallPolygon& polygon, const Vec3& n) {
  SmallPolygon above;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const Vec3 &a = polygon.corners[i], &b = polygon.corners[(i + 1) % polygon.count];
    const double height_a = math::dot(n, a), height_b = math::dot(n, b);
    if (height_a > 0) above.add(a);
    if ((height_a > 0) != (height_b > 0)) above.add(a + (b - a) * (height_a / (height_a - height_b)));
  }
  return above;
}

/// |∫ n·ω dω| over a polygon seen from the origin, on one side of the plane across the unit normal `n`; either way
/// round. Lambert's formula, after Baum, Rushmeier, Winget, "Improving Radiosity Solutions Through the Use of
/// Analytically Determined Form-Factors", SIGGRAPH 1989.
inline double projected_solid_angle(const SmallPolygon& polygon, const Vec3& n) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const Vec3 &a = polygon.corners[i], &b = polygon.corners[(i + 1) % polygon.count];
    const Vec3 across = math::cross(a, b);
    const double size = math::length(across);
    if (size > 0) sum += math::arc_tangent(size, math::dot(a, b)) * math::dot(n, across) / size;
  }
  return 0.5 * std::fabs(sum);
}

/// ∫ |n·ω| dω over what a quadrilateral seen from the origin, `corners` in order, shows above the horizon of `facing`;
/// within some 1e-15.
inline double projected_solid_angle(const std::array<Vec3, 4>& corners, const Vec3& facing, const Vec3& n) {
  SmallPolygon whole;
  for (const Vec3& corner : corners) whole.add(corner);
  const SmallPolygon above = clipped(whole, facing);
  if (n == facing || n == -facing) return projected_solid_angle(above, n);
  return projected_solid_angle(clipped(above, n), n) + projected_solid_angle(clipped(above, -n), n);
}

/// Of a quadrilateral seen from the origin, `corners` in order. Van Oosterom, Strackee, "The Solid Angle of a Plane
/// Triangle", IEEE Transactions on Biomedical Engineering 30(2), 1983.
inline double solid_angle(const std::array<Vec3, 4>& corners) {
  std::array<Vec3, 4> unit;
  for (std::size_t i = 0; i < 4; ++i) unit[i] = math::normalize(corners[i]);
  const auto of_triangle = [](const Vec3& a, const Vec3& b, const Vec3& c) {
    return 2 * math::arc_tangent(std::fabs(math::dot(a, math::cross(b, c))),
                                 1 + math::dot(a, b) + math::dot(b, c) + math::dot(c, a));
  };
  return of_triangle(unit[0], unit[1], unit[2]) + of_triangle(unit[0], unit[2], unit[3]);
}

/// |∫ n·ω dω| over a sphere with its center at `center`, seen from outside and on one side of the plane across `n`.
inline double projected_solid_angle(const Vec3& center, double radius, const Vec3& n) {
  const double distance = math::length(center), sine = radius / distance;
  return math::pi * sine * sine * std::fabs(math::dot(n, center) / distance);
}

/// ∫ max(0, n·ω) dω over a sphere with its center at `center` that the plane across the unit normal `n` cuts, seen from
/// outside; loses digits like 1e-16 (distance / radius)². Snyder, "Area Light Sources for Real-Time Graphics",
/// Microsoft Research MSR-TR-96-11, 1996.
inline double projected_solid_angle_above(const Vec3& center, double radius, const Vec3& n) {
  const double distance = math::length(center), h = distance / radius;
  const double cosine = math::dot(n, center) / distance;
  const double s = std::sqrt((h - 1) * (h + 1));
  // Of h² cos² ω ≤ 1, where the plane cuts the sphere.
  const double rest = std::sqrt(std::max(0.0, (1 - h * cosine) * (1 + h * cosine)));
  const double horizon = math::arc_tangent(rest, s);           // acos(s / (h sin ω))
  const double across = math::arc_tangent(rest, -s * cosine);  // acos(−s cot ω)
  const double sum = horizon + (cosine * across - s * rest) / (h * h);
  return std::max(0.0, sum);
}

}  // namespace penumbra::shading
