#include "tests/bench/flat_scene.h"

#include <stdexcept>

namespace penumbra::bench {
namespace {

class Flattener {
 public:
  Flattener(const scene::Description& description, FlatScene& flat) : description_(description), flat_(flat) {}

  /// Before any instance of them.
  void add_meshes() {
    for (const scene::Mesh& mesh : description_.meshes) flat_.meshes.push_back(triangles_of(mesh, {}));
  }
  void add_all(const std::vector<scene::Object>& objects, const math::Affine& transform) {
    for (const scene::Object& object : objects) {
      material_ = static_cast<std::uint32_t>(object.material);
      std::visit([&](const auto& shape) { add(shape, transform); }, object.shape);
    }
  }

 private:
  void add(const scene::Triangle& t, const math::Affine& transform) {
    flat_.triangles.push_back(
        {{transform.point(t.vertices[0]), transform.point(t.vertices[1]), transform.point(t.vertices[2])}, material_});
  }
  void add(const scene::Mesh& mesh, const math::Affine& transform) {
    const std::vector<FlatTriangle> triangles = triangles_of(mesh, transform);
    flat_.triangles.insert(flat_.triangles.end(), triangles.begin(), triangles.end());
  }
  void add(const scene::Instance& instance, const math::Affine& transform) {
    if (!math::is_black(description_.materials[material_].transmission))
      throw std::invalid_argument("transparent instance");
    const math::Affine to_world = transform * instance.transform;
    flat_.instances.push_back(
        {static_cast<std::uint32_t>(instance.mesh), material_, to_world, math::inverse(to_world)});
  }
  void add(const scene::Group& group, const math::Affine& transform) {
    add_all(group.objects, transform * group.transform);
  }
  void add(const scene::Sphere& sphere, const math::Affine& transform) {
    require_identity(transform);
    flat_.spheres.push_back({sphere.center, sphere.radius, material_});
  }
  void add(const scene::Cylinder& c, const math::Affine& transform) {
    require_identity(transform);
    flat_.cylinders.push_back({c.point, c.point + math::normalize(c.direction) * c.height, c.radius, material_});
  }
  void add(const scene::Polygon&, const math::Affine&) { throw std::invalid_argument("polygon"); }
  void add(const scene::Plane&, const math::Affine&) { throw std::invalid_argument("plane"); }
  void add(const scene::Tube&, const math::Affine&) { throw std::invalid_argument("tube"); }
  std::vector<FlatTriangle> triangles_of(const scene::Mesh& mesh, const math::Affine& transform) {
    const math::Affine back = math::inverse(transform);
    std::vector<FlatTriangle> triangles;
    for (const auto& [a, b, c] : mesh.triangles) {
      triangles.push_back(
          {{transform.point(mesh.positions[a]), transform.point(mesh.positions[b]), transform.point(mesh.positions[c])},
           material_});
      if (mesh.normals.empty()) continue;
      triangles.back().normals = static_cast<std::uint32_t>(flat_.normals.size());
      const auto normal = [&](std::uint32_t vertex) {
        if (mesh.normals[vertex] == Vec3{}) throw std::invalid_argument("a vertex without a normal");
        return back.transposed_vector(math::normalize(mesh.normals[vertex]));
      };
      flat_.normals.push_back({normal(a), normal(b), normal(c)});
    }
    return triangles;
  }
  static void require_identity(const math::Affine& transform) {
    if (!(transform == math::Affine{})) throw std::invalid_argument("transformed sphere or cylinder");
  }

  const scene::Description& description_;
  FlatScene& flat_;
  std::uint32_t material_ = 0;
};

}  // namespace

FlatScene flatten(const scene::Description& description) {
  FlatScene flat;
  Flattener flattener(description, flat);
  flattener.add_meshes();
  flattener.add_all(description.objects, {});
  return flat;
}

}  // namespace penumbra::bench
