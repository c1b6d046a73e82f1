#include <algorithm>
#include <array>
#include <cmath>

#include "engine/accel/queries.h"
#include "engine/accel/triangle_lanes.h"
#include "engine/accel/wide_walk.h"
#include "engine/math/error_free.h"

namespace penumbra::accel {
namespace {

/// The unit normal that a smooth mesh has there; of a flat one, `flat`.
Vec3 shading_normal(const TriangleSet& triangles, std::uint32_t index, const Hit& hit, const Vec3& flat) {
  if (triangles.normals.empty()) return flat;
  const auto& [a, b, c] = triangles.corners[index];
  const Vec3 sum =
      triangles.normals[a] * (1 - hit.b1 - hit.b2) + triangles.normals[b] * hit.b1 + triangles.normals[c] * hit.b2;
  return math::normalize_or(sum, flat);
}

geometry::SurfacePoint point_on_triangle(const TriangleSet& triangles, std::uint32_t index, const Hit& hit) {
  geometry::SurfacePoint point = point_on(triangles[index], hit.b1, hit.b2);
  point.shading_normal = shading_normal(triangles, index, hit, point.normal);
  return point;
}

/// Where a triangle that is met in its own place is, if one is.
struct TrianglePlace {
  const TriangleSet* set = nullptr;
  std::uint32_t index = 0;
};
TrianglePlace triangle_of(const World& world, const SurfaceId& surface) {
  const Item& item = world.items[surface.item];
  if (item.kind == Kind::patch) return {&world.triangles, item.index + surface.part};
  if (item.kind == Kind::mesh && item.placement == no_placement)
    return {&world.meshes[item.index].triangles, surface.part};
  return {};
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

void surfaces_at(const World& world, const Bundle& bundle, unsigned which, const Hit* hits,
                 geometry::SurfacePoint* points) {
  TriangleLanes lanes;
  std::array<TrianglePlace, bundle_width> triangles;
  unsigned together = 0;
  for (std::size_t i = 0; i < bundle.size(); ++i) {
    if ((which >> i & 1u) == 0) continue;
    triangles[i] = triangle_of(world, hits[i].surface);
    if (triangles[i].set == nullptr) {
      points[i] = surface_at(world, {bundle.origin(i), bundle.direction(i), {}}, hits[i]);
      continue;
    }
    const auto set = [&](std::size_t lane) {
      lanes.set(lane, (*triangles[i].set)[triangles[i].index], hits[i].b1, hits[i].b2);
    };
    for (std::size_t lane = 0; lane < bundle_width && together == 0; ++lane) set(lane);
    if (together != 0) set(i);
    together |= 1u << i;
  }
  if (together == 0) return;
  PlaceLanes places;
  find_places(lanes, places);
  for (std::size_t i = 0; i < bundle.size(); ++i) {
    if ((together >> i & 1u) == 0) continue;
    points[i] = places[i];
    points[i].shading_normal = shading_normal(*triangles[i].set, triangles[i].index, hits[i], points[i].normal);
  }
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
