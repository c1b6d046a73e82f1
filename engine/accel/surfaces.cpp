#include <algorithm>
#include <cmath>

#include "engine/accel/queries.h"
#include "engine/accel/wide_walk.h"
#include "engine/math/error_free.h"

namespace penumbra::accel {
namespace {

geometry::SurfacePoint point_on_triangle(const TriangleSet& triangles, std::uint32_t index, const Hit& hit) {
  geometry::SurfacePoint point = point_on(triangles[index], hit.b1, hit.b2);
  if (triangles.normals.empty()) return point;
  const auto& [a, b, c] = triangles.corners[index];
  const Vec3 sum =
      triangles.normals[a] * (1 - hit.b1 - hit.b2) + triangles.normals[b] * hit.b1 + triangles.normals[c] * hit.b2;
  point.shading_normal = math::normalize_or(sum, point.shading_normal);
  return point;
}

}  // namespace

geometry::SurfacePoint surface_at(const World& world, const Ray& ray, const Hit& hit) {
  const Item& item = world.items[hit.surface.item];
  if (item.kind == Kind::patch) return point_on_triangle(world.triangles, item.index + hit.surface.part, hit);
  const Placement* placement = item.placement == no_placement ? nullptr : &world.placements[item.placement];
  const auto local_point = [&]() -> geometry::SurfacePoint {
    if (item.kind == Kind::mesh) return point_on_triangle(world.meshes[item.index].triangles, hit.surface.part, hit);
    const Vec3 world_point = ray.origin + ray.direction * hit.t;
    const Vec3 near = placement == nullptr ? world_point : placement->world_to_local.point(world_point);
    switch (item.kind) {
      case Kind::sphere:
        return geometry::surface_at(world.spheres[item.index], near, hit.surface.part);
      case Kind::plane:
        return geometry::surface_at(world.planes[item.index], near, hit.surface.part);
      case Kind::tube:
        return geometry::surface_at(world.tubes[item.index], near, hit.surface.part);
      case Kind::cylinder:
        return geometry::surface_at(world.cylinders[item.index], near, hit.surface.part);
      case Kind::patch:
      case Kind::mesh:
        break;
    }
    return {};
  };
  geometry::SurfacePoint point = local_point();
  if (placement == nullptr) return point;
  // Into the world: the map's own rounding, and that of taking the next ray back into this space, count as error too.
  const math::Affine &out = placement->local_to_world, &in = placement->world_to_local;
  const auto abs_vector = [](const math::Affine& map, const Vec3& v) {
    return math::abs(map.column[0]) * v.x + math::abs(map.column[1]) * v.y + math::abs(map.column[2]) * v.z;
  };
  const Vec3 local_size = math::abs(point.position);
  point.position = out.point(point.position);
  const Vec3 back = abs_vector(in, math::abs(point.position)) + math::abs(in.translation);
  point.error = abs_vector(out, point.error + back * math::gamma(8) + local_size * math::gamma(8)) +
                math::abs(out.translation) * math::gamma(8);
  point.normal = math::normalize(in.transposed_vector(point.normal));
  point.shading_normal = math::normalize(in.transposed_vector(point.shading_normal));
  return point;
}

namespace {

/// What t of a hit may be off: by the rounding that found it, and by how far its point may be off its surface and its
/// ray.
double error_of_t(const World& world, const geometry::PreparedRay& ray, const Hit& hit) {
  const geometry::SurfacePoint point = surface_at(world, {ray.origin, ray.direction, {}}, hit);
  const Vec3 reach = math::abs(ray.origin) + math::abs(ray.direction) * hit.t;
  const double across = math::taxicab(point.error) + math::taxicab(reach) * math::gamma(16),
               slope = std::fabs(math::dot(point.normal, ray.direction));
  double error = across / slope;
  const Item& item = world.items[hit.surface.item];
  if (item.kind == Kind::patch) {
    error += geometry::error_of_t(world.triangles[item.index + hit.surface.part], ray);
  } else if (item.kind == Kind::mesh) {
    error += in_mesh_space(world, item, ray, [&](const MeshShape& mesh, const geometry::PreparedRay& local) {
      return geometry::error_of_t(mesh.triangles[hit.surface.part], local);
    });
  }
  const double most = hit.t * Nearest::most_error;
  return error < most ? error : most;
}

}  // namespace

std::optional<Hit> first_met(const World& world, const geometry::PreparedRay& ray, const Nearest& nearest) {
  const std::span<const Hit> hits = nearest.hits();
  if (hits.size() < 2) return hits.empty() ? std::nullopt : std::optional(hits.front());
  const auto is_nearer = [](const Hit& a, const Hit& b) { return a.t != b.t ? a.t < b.t : a.surface < b.surface; };
  const Hit& first = *std::ranges::min_element(hits, is_nearer);
  const double error = error_of_t(world, ray, first);
  const auto is_met_before = [&](const Hit& a, const Hit& b) {
    const bool is_opaque = world.items[a.surface.item].is_opaque;
    if (is_opaque != world.items[b.surface.item].is_opaque) return is_opaque;
    return a.surface.item != b.surface.item ? a.surface.item < b.surface.item : is_nearer(a, b);
  };
  const Hit* met = &first;
  for (const Hit& hit : hits) {
    if (hit.t - first.t <= error + error_of_t(world, ray, hit) && is_met_before(hit, *met)) met = &hit;
  }
  return *met;
}

}  // namespace penumbra::accel
