#include "tests/bench/flat_scene.h"

#include <stdexcept>

namespace penumbra::bench {
namespace {

class Flattener {
 public:
  Flattener(const scene::Description& description, FlatScene& flat) : description_(description), flat_(flat) {}

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
    if (!mesh.normals.empty()) throw std::invalid_argument("smooth normals");
    for (const auto& [a, b, c] : mesh.triangles) {
      add(scene::Triangle{{mesh.positions[a], mesh.positions[b], mesh.positions[c]}}, transform);
    }
  }
  void add(const scene::Instance& instance, const math::Affine& transform) {
    add(description_.meshes[static_cast<std::size_t>(instance.mesh)], transform * instance.transform);
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
  Flattener(description, flat).add_all(description.objects, {});
  return flat;
}

}  // namespace penumbra::bench
