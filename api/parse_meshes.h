#pragma once
#include <cstddef>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "api/fields.h"
#include "api/reach.h"
#include "engine/scene/shapes.h"

namespace penumbra::api {

/// Reads `positions`, `indices` and `normals` of a mesh object or of a member of `scene.meshes`. What is wrong is
/// reported.
scene::Mesh read_mesh(Members& members);

/// The shared meshes of a scene, in their order.
class Meshes {
 public:
  /// Reads a member of `scene.meshes`, which must outlive this.
  void add(std::string_view name, const Field& field);
  /// Reads an instance's `mesh`; a name that no mesh has is reported.
  std::optional<scene::MeshId> read_use(const Field& field) const;

  Reach reach_of(scene::MeshId mesh) const;

  const std::vector<scene::Mesh>& all() const { return meshes_; }
  std::vector<scene::Mesh> take() { return std::move(meshes_); }

 private:
  std::vector<scene::Mesh> meshes_;
  std::vector<Reach> reaches_;  // by mesh
  std::map<std::string_view, scene::MeshId> named_;
};

}  // namespace penumbra::api
