#pragma once
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "api/fields.h"
#include "engine/scene/material.h"

namespace penumbra::api {

/// The materials of a scene: first the named ones in their order, then, as objects ask for them, the inline ones and
/// the one of objects without a material.
class Materials {
 public:
  /// Reads a member of `scene.materials`, which must outlive this.
  void add_named(std::string_view name, const Field& field);
  /// Reads an object's `material`, a name or an inline material. What is wrong is reported.
  scene::MaterialId read_use(const Field& field);
  scene::MaterialId of_no_material();

  std::vector<scene::Material> take() { return std::move(materials_); }

 private:
  scene::MaterialId add(const scene::Material& material);

  std::vector<scene::Material> materials_;
  std::map<std::string_view, scene::MaterialId> named_;
  std::optional<scene::MaterialId> default_;
};

}  // namespace penumbra::api
