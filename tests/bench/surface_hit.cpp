#include "tests/bench/surface_hit.h"

namespace penumbra::bench {

SurfaceHit on_triangle(const FlatScene& flat, const FlatTriangle& triangle, double b1, double b2) {
  const Vec3 &a = triangle.vertices[0], e1 = triangle.vertices[1] - a, e2 = triangle.vertices[2] - a;
  const Vec3 normal = math::normalize(math::cross(e1, e2));
  SurfaceHit hit{a + e1 * b1 + e2 * b2, normal, normal, triangle.material};
  for (const Vec3& vertex : triangle.vertices) hit.size = std::max(hit.size, largest_coordinate(vertex));
  if (triangle.normals != no_normals) {
    const FlatNormals& n = flat.normals[triangle.normals];
    hit.shading_normal = math::normalize(n[0] * (1 - b1 - b2) + n[1] * b1 + n[2] * b2);
  }
  return hit;
}

SurfaceHit placed(const FlatInstance& instance, const SurfaceHit& hit) {
  const auto turned = [&](const Vec3& n) { return math::normalize(instance.to_mesh.transposed_vector(n)); };
  double scale = 0;
  for (const Vec3& column : instance.to_world.column) scale = std::max(scale, largest_coordinate(column));
  const double size = std::max(hit.size * scale, largest_coordinate(instance.to_world.translation));
  return {instance.to_world.point(hit.position), turned(hit.normal), turned(hit.shading_normal), instance.material,
          size};
}

}  // namespace penumbra::bench
