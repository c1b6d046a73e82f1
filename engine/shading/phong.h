#pragma once
#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"
#include "engine/shading/shading_point.h"

namespace penumbra::shading {

/// specular·max(0, −v·r)^shininess of the contract, from −v·r, with r = l − 2(l·n)n; `l` is the unit direction the
/// light travels.
inline Color highlight(const CompiledMaterial& material, double mirrored) {
  if (math::is_black(material.specular) || (mirrored <= 0 && material.shininess > 0)) return math::black;
  return material.specular * math::power(std::clamp(mirrored, 0.0, 1.0), material.shininess);
}
inline Color highlight(const ShadingPoint& at, const Vec3& l) {
  const Vec3& n = at.surface.shading_normal;
  return highlight(*at.material, -math::dot(at.view, l - n * (2 * math::dot(l, n))));
}

/// diffuse·|n·l| and the highlight. The side test is the caller's.
inline Color phong(const ShadingPoint& at, const Vec3& l) {
  return at.material->diffuse * std::fabs(math::dot(l, at.surface.shading_normal)) + highlight(at, l);
}

/// What the surface sends to the viewer of light that travels along the unit `l`: something only where both are on one
/// side of the geometric surface.
inline Color lobe_towards(const ShadingPoint& at, const Vec3& l) {
  return math::dot(at.facing, l) < 0 ? phong(at, l) : math::black;
}

}  // namespace penumbra::shading
