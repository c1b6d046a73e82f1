#pragma once
#include <cstdint>

#include "engine/math/color.h"

namespace penumbra::scene {

using math::Color;

/// Phong material of the contract, section 1. All colours ≥ 0; reflection and transmission ≤ 1 per channel.
struct Material {
  Color emission = math::black;
  Color ambient = math::white;
  Color diffuse = math::black;
  Color specular = math::black;
  double shininess = 0;
  Color reflection = math::black;
  Color transmission = math::black;
  double ior = 1;
  bool operator==(const Material&) const = default;
};

/// Index into Description::materials.
enum class MaterialId : std::uint32_t {};

/// What an object without a material is made of.
inline Material default_material() {
  Material m;
  m.diffuse = math::grey(0.8);
  return m;
}

}  // namespace penumbra::scene
