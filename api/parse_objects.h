#pragma once
#include <cstddef>
#include <vector>

#include "api/fields.h"
#include "api/parse_materials.h"
#include "api/parse_meshes.h"
#include "engine/scene/shapes.h"

namespace penumbra::api {

/// What objects refer to, and how they may be.
struct ObjectContext {
  Materials& materials;
  const Meshes& meshes;
  std::size_t max_polygon_vertices;
};

/// Reads `scene.objects`; what is wrong is reported and left out.
std::vector<scene::Object> read_objects(const Field& field, ObjectContext& context);

}  // namespace penumbra::api
