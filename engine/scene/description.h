#pragma once
#include <string>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/lights.h"
#include "engine/scene/material.h"
#include "engine/scene/shapes.h"

namespace penumbra::scene {

/// What people write, as plain checked values: every number finite, every id in range, every rule of section 1 kept.
/// `compile` turns it into what rays need.
struct Description {
  std::string name;
  Camera camera;
  Color background = math::black;
  Color ambient = math::black;
  std::vector<Material> materials;
  std::vector<Mesh> meshes;  // the shared ones; a Mesh object carries its own
  std::vector<Object> objects;
  std::vector<Light> lights;
};

}  // namespace penumbra::scene
