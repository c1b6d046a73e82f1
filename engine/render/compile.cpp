#include "engine/render/compile.h"

#include <algorithm>

#include "engine/accel/tree.h"
#include "engine/geometry/polygon.h"
#include "engine/math/elementary.h"

namespace penumbra::render {
namespace {

using math::Affine;
using math::Vec3;

shading::CompiledMaterial compiled(const scene::Material& material) {
  shading::CompiledMaterial result{material};
  result.is_lit = !math::is_black(material.diffuse) || !math::is_black(material.specular);
  result.reflects = !math::is_black(material.reflection);
  result.transmits = !math::is_black(material.transmission);
  return result;
}

accel::MeshShape compiled(const scene::Mesh& mesh, const Affine& transform, scene::Acceleration acceleration) {
  accel::MeshShape shape;
  const bool is_mirrored = transform.determinant() < 0;
  const Affine back = math::inverse(transform);
  const bool is_identity = transform == Affine{};
  shape.triangles.reserve(mesh.triangles.size());
  for (std::array<std::uint32_t, 3> corner : mesh.triangles) {
    if (is_mirrored) std::swap(corner[1], corner[2]);
    const auto position = [&](std::uint32_t i) {
      return is_identity ? mesh.positions[i] : transform.point(mesh.positions[i]);
    };
    shape.triangles.push_back({position(corner[0]), position(corner[1]), position(corner[2])});
    if (mesh.normals.empty()) continue;
    const auto normal = [&](std::uint32_t i) { return math::normalize(back.transposed_vector(mesh.normals[i])); };
    shape.normals.push_back({normal(corner[0]), normal(corner[1]), normal(corner[2])});
  }
  std::vector<accel::TreeEntry> entries;
  entries.reserve(shape.triangles.size());
  for (std::uint32_t i = 0; i < shape.triangles.size(); ++i) {
    const geometry::TriangleVertices& t = shape.triangles[i];
    math::Bounds box;
    box.include(t.v0), box.include(t.v1), box.include(t.v2);
    entries.push_back({box, i, &t});
    shape.bounds.include(box);
  }
  // Inside a mesh there is nothing left to box or group by object.
  const bool has_tree = acceleration == scene::Acceleration::median || acceleration == scene::Acceleration::bvh;
  shape.tree = std::make_shared<accel::Tree>(has_tree ? acceleration : scene::Acceleration::none, entries);
  return shape;
}

class Compiler {
 public:
  Compiler(const scene::Description& description, scene::Acceleration acceleration)
      : description_(description), acceleration_(acceleration) {
    for (const scene::Mesh& mesh : description.meshes) world_.meshes.push_back(compiled(mesh, {}, acceleration));
  }

  void add_objects(shading::Scene& scene) {
    for (const scene::Material& material : description_.materials) materials_.push_back(compiled(material));
    accel::Grouping root = add_all(description_.objects, {});
    build_tree(root);
    scene.world = std::move(world_);
    scene.materials = std::move(materials_);
    scene.item_material = std::move(item_material_);
  }

 private:
  accel::Grouping add_all(const std::vector<scene::Object>& objects, const Affine& transform) {
    accel::Grouping grouping;
    for (const scene::Object& object : objects) {
      if (const auto* group = std::get_if<scene::Group>(&object.shape)) {
        grouping.groups.push_back(add_all(group->objects, transform * group->transform));
        continue;
      }
      const auto first = static_cast<std::uint32_t>(world_.items.size());
      material_ = static_cast<std::uint32_t>(object.material);
      std::visit([&](const auto& shape) { add(shape, transform); }, object.shape);
      for (auto item = first; item < world_.items.size(); ++item) grouping.entries.push_back(item);
    }
    return grouping;
  }

  void add_item(accel::Kind kind, std::size_t index, std::uint32_t placement = accel::not_placed) {
    const bool is_opaque = !materials_[material_].transmits;
    world_.items.push_back({kind, is_opaque, static_cast<std::uint32_t>(index), placement});
    item_material_.push_back(material_);
  }

  std::uint32_t place(const Affine& transform) {
    if (transform == Affine{}) return accel::not_placed;
    world_.placements.push_back({transform, math::inverse(transform)});
    return static_cast<std::uint32_t>(world_.placements.size() - 1);
  }

  void add_triangle(Vec3 a, Vec3 b, Vec3 c, const Affine& transform) {
    if (!(transform == Affine{})) {
      a = transform.point(a), b = transform.point(b), c = transform.point(c);
      if (transform.determinant() < 0) std::swap(b, c);
    }
    world_.triangles.push_back({a, b, c});
    add_item(accel::Kind::triangle, world_.triangles.size() - 1);
  }

  void add(const scene::Triangle& triangle, const Affine& transform) {
    add_triangle(triangle.vertices[0], triangle.vertices[1], triangle.vertices[2], transform);
  }
  void add(const scene::Polygon& polygon, const Affine& transform) {
    for (const auto& [a, b, c] : geometry::triangulate(polygon.vertices))
      add_triangle(polygon.vertices[a], polygon.vertices[b], polygon.vertices[c], transform);
  }
  void add(const scene::Sphere& sphere, const Affine& transform) {
    world_.spheres.push_back({sphere.center, sphere.radius});
    add_item(accel::Kind::sphere, world_.spheres.size() - 1, place(transform));
  }
  void add(const scene::Plane& plane, const Affine& transform) {
    const Vec3 normal = math::inverse(transform).transposed_vector(math::normalize(plane.normal));
    world_.planes.push_back({transform.point(plane.point), math::normalize(normal)});
    add_item(accel::Kind::plane, world_.planes.size() - 1);
  }
  void add(const scene::Tube& tube, const Affine& transform) {
    world_.tubes.push_back({tube.point, math::normalize(tube.direction), tube.radius});
    add_item(accel::Kind::tube, world_.tubes.size() - 1, place(transform));
  }
  void add(const scene::Cylinder& c, const Affine& transform) {
    world_.cylinders.push_back({c.point, math::normalize(c.direction), c.radius, c.height, c.caps});
    add_item(accel::Kind::cylinder, world_.cylinders.size() - 1, place(transform));
  }
  void add(const scene::Mesh& mesh, const Affine& transform) {
    world_.meshes.push_back(compiled(mesh, transform, acceleration_));
    add_item(accel::Kind::mesh, world_.meshes.size() - 1);
  }
  void add(const scene::Instance& instance, const Affine& transform) {
    add_item(accel::Kind::mesh, static_cast<std::size_t>(instance.mesh), place(transform * instance.transform));
  }
  void add(const scene::Group&, const Affine&) {}

  void build_tree(accel::Grouping& root) {
    std::vector<accel::TreeEntry> entries;
    std::vector<std::uint32_t> entry_of(world_.items.size(), accel::not_placed);
    for (std::uint32_t i = 0; i < world_.items.size(); ++i) {
      const accel::Item& item = world_.items[i];
      const auto box = bounds_of(world_, item);
      if (!box) {
        world_.infinite_items.push_back(i);
      } else if (!box->is_empty()) {
        entry_of[i] = static_cast<std::uint32_t>(entries.size());
        entries.push_back({*box, i, item.kind == accel::Kind::triangle ? &world_.triangles[item.index] : nullptr});
      }
    }
    if (acceleration_ == scene::Acceleration::groups) renumber(root, entry_of);
    world_.tree = std::make_shared<accel::Tree>(acceleration_, entries, root);
  }

  static void renumber(accel::Grouping& grouping, const std::vector<std::uint32_t>& entry_of) {
    std::vector<std::uint32_t> kept;
    for (const std::uint32_t item : grouping.entries) {
      if (entry_of[item] != accel::not_placed) kept.push_back(entry_of[item]);
    }
    grouping.entries = std::move(kept);
    for (accel::Grouping& group : grouping.groups) renumber(group, entry_of);
  }

  const scene::Description& description_;
  scene::Acceleration acceleration_;
  accel::World world_;
  std::vector<shading::CompiledMaterial> materials_;
  std::vector<std::uint32_t> item_material_;
  std::uint32_t material_ = 0;  // of the object being added
};

shading::Light compiled(const scene::PointLight& light) {
  return shading::DiscLight{light.position, light.intensity, light.attenuation, light.radius, false, {}, 0, 0};
}
shading::Light compiled(const scene::SpotLight& light) {
  return shading::DiscLight{light.position,
                            light.intensity,
                            light.attenuation,
                            light.radius,
                            true,
                            math::normalize(light.direction),
                            light.exponent,
                            math::sine_cosine_degrees(light.cutoff_degrees).cosine};
}
shading::Light compiled(const scene::DirectionalLight& light) {
  const auto [sine, cosine] = math::sine_cosine_degrees(light.angular_radius_degrees);
  return shading::DistantLight{math::normalize(light.direction), light.intensity, sine / cosine};
}
shading::Light compiled(const scene::RectangleLight& light) {
  const Vec3 normal = math::cross(light.edge_u, light.edge_v);
  const double skew = std::fabs(math::dot(light.edge_u, light.edge_v));
  const bool is_right_angled = skew <= math::gamma(16) * math::length(light.edge_u) * math::length(light.edge_v);
  return shading::RectangleLight{light.corner,   light.edge_u,         light.edge_v,   math::normalize(normal),
                                 light.radiance, math::length(normal), is_right_angled};
}
shading::Light compiled(const scene::SphereLight& light) {
  return shading::SphereLight{light.center, light.radius, light.radiance};
}

math::Color& brightness(scene::Light& light) {
  return std::visit(
      [](auto& l) -> math::Color& {
        if constexpr (requires { l.intensity; }) {
          return l.intensity;
        } else {
          return l.radiance;
        }
      },
      light);
}

bool differ_only_in_brightness(scene::Light a, scene::Light b) {
  brightness(a) = brightness(b) = {};
  return a == b;
}

}  // namespace

Compiled compile(const scene::Description& description, const CompileSettings& settings) {
  Compiled result;
  Compiler(description, settings.acceleration).add_objects(result.scene);
  std::vector<scene::Light> lights;
  for (scene::Light light : description.lights) {
    const auto twin = std::find_if(lights.begin(), lights.end(),
                                   [&](const scene::Light& l) { return differ_only_in_brightness(l, light); });
    if (settings.merge_lights && twin != lights.end()) {
      brightness(*twin) += brightness(light);
      ++result.merged_lights;
    } else {
      lights.push_back(light);
    }
  }
  for (const scene::Light& light : lights) {
    result.scene.lights.push_back(std::visit([](const auto& l) { return compiled(l); }, light));
  }
  result.scene.background = description.background;
  result.scene.ambient = description.ambient;
  return result;
}

}  // namespace penumbra::render
