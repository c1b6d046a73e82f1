#pragma once
#include <cmath>
#include <optional>

#include "engine/math/vec3.h"
#include "engine/scene/material.h"

namespace penumbra::hunt {

inline constexpr double pi = 3.14159265358979323846;

/// An orthonormal frame around the unit `w`.
struct Axes {
  math::Vec3 u, v, w;
  explicit Axes(const math::Vec3& axis) : w(axis) {
    u = math::normalize(math::cross(std::fabs(w.x) < 0.6 ? math::Vec3{1, 0, 0} : math::Vec3{0, 1, 0}, w));
    v = math::cross(w, u);
  }
};

inline math::Vec3 mirrored(const math::Vec3& v, const math::Vec3& n) {
  return math::normalize(v - n * (2 * math::dot(v, n)));
}

/// Snell's law; nothing under total internal reflection. `ratio` = ior on this side / on the other.
inline std::optional<math::Vec3> refracted(const math::Vec3& v, const math::Vec3& n, double ratio) {
  const math::Vec3 facing = math::dot(v, n) > 0 ? -n : n;
  const math::Vec3 along = (v + facing * -math::dot(v, facing)) * ratio;
  const double left = 1 - math::dot(along, along);
  if (left <= 0) return std::nullopt;
  return math::normalize(along - facing * std::sqrt(left));
}

/// diffuse·|n·l| + specular·max(0, −v·r)^shininess.
inline math::Color lobe(const scene::Material& m, const math::Vec3& l, const math::Vec3& v, const math::Vec3& n) {
  const math::Vec3 r = l - n * (2 * math::dot(l, n));
  return m.diffuse * std::fabs(math::dot(n, l)) + m.specular * std::pow(std::max(0.0, -math::dot(v, r)), m.shininess);
}

}  // namespace penumbra::hunt
