#pragma once
#include "engine/math/elementary.h"
#include "engine/shading/shadows.h"

namespace penumbra::shading {

/// diffuse·|n·l| + specular·max(0, −v·r)^shininess of the contract, with r = l − 2(l·n)n; `l` is the unit direction the
/// light travels. The side test is the caller's.
inline Color phong(const ShadingPoint& at, const Vec3& l) {
  const CompiledMaterial& material = *at.material;
  const Vec3& n = at.surface.shading_normal;
  const double l_n = math::dot(l, n);
  Color result = material.diffuse * std::fabs(l_n);
  if (!math::is_black(material.specular)) {
    const double highlight = -math::dot(at.view, l - n * (2 * l_n));
    const double base = std::clamp(highlight, 0.0, 1.0);
    if (base > 0 || material.shininess == 0) result += material.specular * math::power(base, material.shininess);
  }
  return result;
}

}  // namespace penumbra::shading
