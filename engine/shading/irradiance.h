#pragma once
#include <array>

#include "engine/math/elementary.h"
#include "engine/math/vec3.h"

namespace penumbra::shading {

using math::Vec3;

/// ∫ n·ω dω over a polygon seen from the origin, wholly above the horizon of the unit normal `n`; `corners` in order,
/// either way round. Lambert's formula, after Baum, Rushmeier, Winget, "Improving Radiosity Solutions Through the Use
/// of Analytically Determined Form-Factors", SIGGRAPH 1989.
inline double projected_solid_angle(const std::array<Vec3, 4>& corners, const Vec3& n) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 &a = corners[i], &b = corners[(i + 1) % 4];
    const Vec3 across = math::cross(a, b);
    const double size = math::length(across);
    if (size > 0) sum += math::arc_tangent(size, math::dot(a, b)) * math::dot(n, across) / size;
  }
  return 0.5 * std::fabs(sum);
}

/// The same for a sphere with its centre at `centre`, seen from outside it and wholly above the horizon.
inline double projected_solid_angle(const Vec3& centre, double radius, const Vec3& n) {
  const double distance = math::length(centre), sine = radius / distance;
  return math::pi * sine * sine * math::dot(n, centre) / distance;
}

}  // namespace penumbra::shading
