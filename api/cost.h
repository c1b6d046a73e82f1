#pragma once
#include <cstddef>

#include "engine/scene/description.h"

namespace penumbra::api {

/// How much of everything a scene has.
struct SceneSize {
  std::size_t primitives = 0;        // objects at any depth, groups among them
  std::size_t triangles = 0;         // of meshes, a shared one counted once
  std::size_t positions = 0;         // of meshes, a shared one counted once
  std::size_t smooth_triangles = 0;  // those with normals
  std::size_t polygon_vertices = 0;
};

SceneSize size_of(const scene::Description& description);

}  // namespace penumbra::api
