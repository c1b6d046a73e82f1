#pragma once
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "engine/accel/world.h"
#include "engine/math/color.h"
#include "engine/math/constants.h"
#include "engine/math/vec3.h"
#include "engine/scene/lights.h"
#include "engine/scene/material.h"

namespace penumbra::shading {

using math::Color;
using math::Vec3;

/// A point or spot light, seen as a disc facing the lit point when `radius` > 0.
struct DiscLight {
  Vec3 position;
  Color intensity;
  scene::Attenuation attenuation;
  double radius = 0;
  bool is_spot = false;
  Vec3 direction;  // unit; of a spot
  double exponent = 1, cutoff_cosine = 0;
};

/// From infinity; a disc of directions when `tangent` > 0.
struct DistantLight {
  Vec3 direction;  // unit, the way the light travels
  Color intensity;
  double tangent = 0;  // of the angular radius
};

struct RectangleLight {
  Vec3 corner, edge_u, edge_v, normal;  // `normal` unit, to the lit side
  Color radiance;
};

struct SphereLight {
  Vec3 center;
  double radius = 1;
  Color radiance;
  std::uint32_t lamp = accel::no_item;  // a sphere of the scene in the same place, which hides none of it
  bool stands_free = false;             // for certain: no other surface reaches into it
};

using Light = std::variant<DiscLight, DistantLight, RectangleLight, SphereLight>;

/// A material and what can be known of it before any ray is cast.
struct CompiledMaterial : scene::Material {
  bool is_lit = false;  // diffuse or specular not black
  bool reflects = false, transmits = false;
};

class LightTree;

/// A scene as rays need it. Immutable; may be shared between threads.
struct Scene {
  accel::World world;
  std::vector<CompiledMaterial> materials;
  std::vector<std::uint32_t> item_material;  // of World::items
  std::vector<Light> lights;
  std::shared_ptr<const LightTree> light_tree;  // over `lights`, where they are many
  Color background, ambient;
  double extent = 0;                     // the largest coordinate of what is not infinite, for a scene with area lights
  bool has_many_quadrics = false;        // of finite size
  double typical_edge = math::infinity;  // of triangles that no instances share: about as long as half of them
};

}  // namespace penumbra::shading
