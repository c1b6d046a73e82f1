#include "api/parse_scene.h"

#include "api/cost.h"
#include "api/parse_camera.h"
#include "api/parse_lights.h"
#include "api/parse_objects.h"
#include "api/values.h"

namespace penumbra::api {

namespace {

/// Calls read(name, field) for every member of `object` until the errors are full; reports a field that is no object.
template <class Read>
void for_each_member(const Field& object, const Read& read) {
  if (!object.is_object()) return object.fail("must be an object");
  for (const JsonView member : object.value()) {
    if (object.errors().is_full()) return;
    read(member.key(), Field(object, member.key(), member));
  }
}

void check_size(const scene::Description& description, Members& members, const Limits& limits) {
  const SceneSize size = size_of(description);
  if (size.primitives > limits.max_primitives) {
    members.object().fail_at("objects", "must not hold more than " + std::to_string(limits.max_primitives) +
                                            " objects, groups and their members counted; it holds " +
                                            std::to_string(size.primitives));
  }
  if (description.lights.size() > limits.max_lights) {
    members.object().fail_at("lights", "must not hold more than " + std::to_string(limits.max_lights) +
                                           " lights; it holds " + std::to_string(description.lights.size()));
  }
  if (size.triangles > limits.max_triangles) {
    members.object().fail("must not have more than " + std::to_string(limits.max_triangles) +
                          " triangles in its meshes; it has " + std::to_string(size.triangles));
  }
}

}  // namespace

scene::Description read_scene(const Field& field, const Limits& limits) {
  Members members(field);
  scene::Description description;
  description.name = std::string(members.optional("name", read_string, std::string_view()));
  if (const auto camera = members.required("camera")) description.camera = read_camera(*camera);
  description.background = members.optional("background", read_any_color, description.background);
  description.ambient = members.optional("ambient", read_any_color, description.ambient);

  Materials materials;
  if (const auto named = members.optional("materials")) {
    for_each_member(*named, [&](std::string_view name, const Field& f) { materials.add_named(name, f); });
  }
  Meshes meshes;
  if (const auto named = members.optional("meshes")) {
    for_each_member(*named, [&](std::string_view name, const Field& f) { meshes.add(name, f); });
  }
  if (const auto objects = members.optional("objects")) {
    ObjectContext context{materials, meshes, limits.max_polygon_vertices};
    description.objects = read_objects(*objects, context);
  }
  if (const auto lights = members.optional("lights")) description.lights = read_lights(*lights);
  members.refuse_unknown();

  description.materials = materials.take();
  description.meshes = meshes.take();
  check_size(description, members, limits);
  return description;
}

}  // namespace penumbra::api
