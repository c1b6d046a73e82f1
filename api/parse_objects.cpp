#include "api/parse_objects.h"

#include <variant>

#include "api/polygon_rules.h"
#include "api/reach.h"
#include "api/values.h"

namespace penumbra::api {

namespace {

using math::Affine;
using math::Vec3;

/// What an object's reader works with: its members, and the transform of the groups around it.
struct Work {
  Members& members;
  ObjectContext& context;
  const Affine& placement;
};

Vec3 read_required_point(Members& members, std::string_view name) {
  return members.required(name, read_point).value_or(Vec3{});
}

Vec3 read_required_direction(Members& members, std::string_view name) {
  return members.required(name, read_direction).value_or(Vec3{0, 0, 1});
}

double read_radius(Members& members) { return members.required("radius", number_in(any_length)).value_or(1); }

scene::Shape read_sphere(Work& work) {
  return scene::Sphere{read_required_point(work.members, "center"), read_radius(work.members)};
}

scene::Shape read_plane(Work& work) {
  return scene::Plane{read_required_point(work.members, "point"), read_required_direction(work.members, "normal")};
}

/// Nothing when a vertex is wrong.
std::optional<std::vector<Vec3>> read_vertices(const Field& field) {
  std::vector<Vec3> vertices;
  bool is_valid = true;
  for_each_element(field, [&](const Field& element) {
    const std::optional<Vec3> vertex = read_point(element);
    is_valid = is_valid && vertex.has_value();
    vertices.push_back(vertex.value_or(Vec3{}));
  });
  if (!is_valid || !field.is_array() || vertices.size() != field.value().size()) return std::nullopt;
  return vertices;
}

scene::Shape read_triangle(Work& work) {
  scene::Triangle triangle;
  const std::optional<Field> field = work.members.required("vertices");
  if (!field) return triangle;
  if (field->is_array() && field->value().size() != 3) {
    field->fail("must be an array of 3 vertices");
    return triangle;
  }
  if (const auto vertices = read_vertices(*field)) {
    for (std::size_t i = 0; i < 3; ++i) triangle.vertices[i] = (*vertices)[i];
  }
  return triangle;
}

scene::Shape read_polygon(Work& work) {
  const std::optional<Field> field = work.members.required("vertices");
  if (!field) return scene::Polygon{};
  const std::size_t longest = work.context.max_polygon_vertices;
  if (field->is_array() && (field->value().size() < 3 || field->value().size() > longest)) {
    field->fail("must be an array of 3 to " + std::to_string(longest) + " vertices");
    return scene::Polygon{};
  }
  auto vertices = read_vertices(*field);
  if (!vertices) return scene::Polygon{};
  if (const std::optional<PolygonFault> fault = polygon_fault(*vertices)) {
    if (fault->vertex) {
      field->fail_at(std::to_string(*fault->vertex), fault->detail);
    } else {
      field->fail(fault->detail);
    }
  }
  return scene::Polygon{std::move(*vertices)};
}

scene::Shape read_tube(Work& work) {
  return scene::Tube{read_required_point(work.members, "point"), read_required_direction(work.members, "direction"),
                     read_radius(work.members)};
}

scene::Shape read_cylinder(Work& work) {
  scene::Cylinder cylinder;
  cylinder.point = read_required_point(work.members, "point");
  cylinder.direction = read_required_direction(work.members, "direction");
  cylinder.radius = read_radius(work.members);
  cylinder.height = work.members.required("height", number_in(any_length)).value_or(cylinder.height);
  cylinder.caps = work.members.optional("caps", read_boolean, cylinder.caps);
  return cylinder;
}

scene::Shape read_mesh_object(Work& work) { return read_mesh(work.members); }

/// `placement` after `field`'s transform; reports a product that can no longer be inverted.
std::optional<Affine> read_placed_transform(const Field& field, const Affine& placement) {
  const std::optional<Affine> transform = read_transform(field);
  if (!transform) return std::nullopt;
  const Affine after = placement * *transform;
  const double largest = std::max(std::max(max_component(abs(after.column[0])), max_component(abs(after.column[1]))),
                                  std::max(max_component(abs(after.column[2])), max_component(abs(after.translation))));
  if (!(largest <= largest_length) || !is_invertible(after)) {
    field.fail("must stay invertible and below 1e30 when the transforms of the groups around it are applied");
    return std::nullopt;
  }
  return transform;
}

scene::Shape read_instance(Work& work) {
  scene::Instance instance;
  const auto mesh = work.members.required("mesh", [&](const Field& f) { return work.context.meshes.read_use(f); });
  const auto transform =
      work.members.required("transform", [&](const Field& f) { return read_placed_transform(f, work.placement); });
  instance.mesh = mesh.value_or(instance.mesh);
  instance.transform = transform.value_or(instance.transform);
  return instance;
}

std::vector<scene::Object> read_list(const Field& field, ObjectContext& context, const Affine& placement);

scene::Shape read_group(Work& work) {
  scene::Group group;
  const auto read_placed = [&](const Field& f) { return read_placed_transform(f, work.placement); };
  group.transform = work.members.optional("transform", read_placed, group.transform);
  if (const std::optional<Field> objects = work.members.required("objects")) {
    group.objects = read_list(*objects, work.context, work.placement * group.transform);
  }
  return group;
}

using ObjectReader = scene::Shape (*)(Work&);
constexpr std::array object_readers{std::pair{std::string_view("sphere"), ObjectReader{read_sphere}},
                                    std::pair{std::string_view("plane"), ObjectReader{read_plane}},
                                    std::pair{std::string_view("triangle"), ObjectReader{read_triangle}},
                                    std::pair{std::string_view("polygon"), ObjectReader{read_polygon}},
                                    std::pair{std::string_view("tube"), ObjectReader{read_tube}},
                                    std::pair{std::string_view("cylinder"), ObjectReader{read_cylinder}},
                                    std::pair{std::string_view("mesh"), ObjectReader{read_mesh_object}},
                                    std::pair{std::string_view("instance"), ObjectReader{read_instance}},
                                    std::pair{std::string_view("group"), ObjectReader{read_group}}};
static_assert(object_readers.size() == std::variant_size_v<scene::Shape>, "a shape has no reader");

scene::MaterialId read_object_material(Members& members, Materials& materials) {
  const std::optional<Field> use = members.optional("material");
  return use ? materials.read_use(*use) : materials.of_no_material();
}

/// Refuses what is too far, too large or too small to be rendered right.
void check_reach(const scene::Shape& shape, const Work& work) {
  Reach own = reach_of(shape);
  Affine placement = work.placement;
  if (const auto* instance = std::get_if<scene::Instance>(&shape)) {
    own = work.context.meshes.reach_of(instance->mesh);
    placement = placement * instance->transform;
  }
  if (own.is_within_limits() && placed(own, placement).is_within_limits()) return;
  work.members.object().fail(
      "must not reach beyond 1e30, nor be smaller than 1e-30, also with the transforms around it applied");
}

// As deep as the body's nesting, which the reader bounds.
// NOLINTNEXTLINE(misc-no-recursion)
std::vector<scene::Object> read_list(const Field& field, ObjectContext& context, const Affine& placement) {
  std::vector<scene::Object> objects;
  for_each_element(field, [&](const Field& element) {
    Members members(element);
    const std::optional<ObjectReader> read = members.required("type", one_of(object_readers));
    if (!read) return;
    Work work{members, context, placement};
    scene::Object object{(*read)(work), {}};
    check_reach(object.shape, work);
    const bool has_material = !std::holds_alternative<scene::Group>(object.shape);
    if (has_material) object.material = read_object_material(members, context.materials);
    members.refuse_unknown();
    objects.push_back(std::move(object));
  });
  return objects;
}

}  // namespace

std::vector<scene::Object> read_objects(const Field& field, ObjectContext& context) {
  return read_list(field, context, Affine{});
}

}  // namespace penumbra::api
