#include "api/parse_materials.h"

#include "api/values.h"

namespace penumbra::api {

namespace {

scene::Material read_material(const Field& field) {
  Members members(field);
  scene::Material material;
  constexpr Range shininesses{0, 1e9};
  material.emission = members.optional("emission", read_any_color, material.emission);
  material.ambient = members.optional("ambient", read_any_color, material.ambient);
  material.diffuse = members.optional("diffuse", read_any_color, material.diffuse);
  material.specular = members.optional("specular", read_any_color, material.specular);
  material.shininess = members.optional("shininess", number_in(shininesses), material.shininess);
  material.reflection = members.optional("reflection", color_up_to(1), material.reflection);
  material.transmission = members.optional("transmission", color_up_to(1), material.transmission);
  material.ior = members.optional("ior", number_in(positive), material.ior);
  members.refuse_unknown();
  return material;
}

}  // namespace

scene::MaterialId Materials::add(const scene::Material& material) {
  materials_.push_back(material);
  return scene::MaterialId{static_cast<std::uint32_t>(materials_.size() - 1)};
}

void Materials::add_named(std::string_view name, const Field& field) {
  named_.emplace(name, add(read_material(field)));
}

scene::MaterialId Materials::read_use(const Field& field) {
  if (field.is_object()) return add(read_material(field));
  if (!field.is_string()) {
    field.fail("must be the name of a material or an object");
  } else if (const auto found = named_.find(field.value().string()); found != named_.end()) {
    return found->second;
  } else {
    field.fail("no material has the name " + quoted(field.value().string()));
  }
  return {};
}

scene::MaterialId Materials::of_no_material() {
  if (!default_) default_ = add(scene::default_material());
  return *default_;
}

}  // namespace penumbra::api
