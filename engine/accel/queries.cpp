#include "engine/accel/queries.h"

#include <algorithm>

#include "engine/accel/slab.h"
#include "engine/accel/tree.h"
#include "engine/accel/wide_walk.h"

namespace penumbra::accel {
namespace {

using geometry::Crossings;
using geometry::PreparedRay;
using geometry::SelfPart;

PreparedRay to_local(const Placement& placement, const PreparedRay& ray) {
  return {placement.world_to_local.point(ray.origin), placement.world_to_local.vector(ray.direction)};
}

SelfPart self_part(const SurfaceId& self, std::uint32_t item) {
  return self.item == item ? SelfPart{self.part} : std::nullopt;
}

/// Of a quadric or plane, in the item's own space.
Crossings local_crossings(const World& world, const Item& item, const Vec3& origin, const Vec3& direction,
                          SelfPart self) {
  switch (item.kind) {
    case Kind::sphere:
      return crossings(world.spheres[item.index], origin, direction, self);
    case Kind::plane:
      return crossings(world.planes[item.index], origin, direction, self);
    case Kind::tube:
      return crossings(world.tubes[item.index], origin, direction, self);
    case Kind::cylinder:
      return crossings(world.cylinders[item.index], origin, direction, self);
    case Kind::patch:
    case Kind::mesh:
      break;
  }
  return {};
}

Crossings world_crossings(const World& world, const Item& item, const PreparedRay& ray, SelfPart self) {
  if (item.placement == not_placed) return local_crossings(world, item, ray.origin, ray.direction, self);
  const math::Affine& map = world.placements[item.placement].world_to_local;
  return local_crossings(world, item, map.point(ray.origin), map.vector(ray.direction), self);
}

/// Calls use(mesh, ray) with the ray in the mesh's space.
template <class Use>
auto in_mesh_space(const World& world, const Item& item, const PreparedRay& ray, const Use& use) {
  const MeshShape& mesh = world.meshes[item.index];
  if (item.placement == not_placed) return use(mesh, ray);
  return use(mesh, to_local(world.placements[item.placement], ray));
}

/// Visits leaves nearest first until one returns true; `limit()` may shrink on the way.
template <class Limit, class Leaf>
bool visit_in_order(const Tree& tree, const Tree::Node& node, const PreparedRay& ray, const Limit& limit,
                    const Leaf& test_leaf) {
  if (node.is_leaf()) return test_leaf(node);
  const auto children = tree.children(node);
  if (children.size() != 2) {
    return std::any_of(children.begin(), children.end(), [&](const Tree::Node& child) {
      return enter(child.box, ray, limit()) < HUGE_VAL && visit_in_order(tree, child, ray, limit, test_leaf);
    });
  }
  const double first = enter(children[0].box, ray, limit()), second = enter(children[1].box, ray, limit());
  const std::size_t near = second < first ? 1 : 0;
  const double near_t = std::min(first, second), far_t = std::max(first, second);
  if (near_t == HUGE_VAL) return false;
  if (visit_in_order(tree, children[near], ray, limit, test_leaf)) return true;
  return far_t < limit() && visit_in_order(tree, children[1 - near], ray, limit, test_leaf);
}

/// Calls at_triangle(index) and at_other(id) for what the ray may meet before `limit()`, roughly nearest first, until
/// one returns true; tells whether one did.
template <class Limit, class AtTriangle, class AtOther>
bool search(const Tree& tree, const PreparedRay& ray, const Limit& limit, const AtTriangle& at_triangle,
            const AtOther& at_other) {
  return enter(tree.root().box, ray, limit()) < HUGE_VAL &&
         visit_in_order(tree, tree.root(), ray, limit, [&](const Tree::Node& leaf) {
           return std::ranges::any_of(tree.triangles(leaf), at_triangle) ||
                  std::ranges::any_of(tree.others(leaf), at_other);
         });
}

/// Offers every hit that could be the nearest.
void find_nearest(const Structure& structure, const OwnedTriangles& triangles, const World& world,
                  const PreparedRay& ray, const SurfaceId& self, Nearest& nearest) {
  if (structure.wide) return walk_to_nearest(*structure.wide, triangles, world, ray, self, nearest);
  search(
      *structure.plain, ray, [&] { return nearest.limit; },
      [&](std::uint32_t triangle) {
        const SurfaceId surface = triangles.surface(triangle);
        if (self == surface) return false;
        if (const auto hit = intersect(triangles[triangle], ray, nearest.limit))
          nearest.offer(hit->t, surface, hit->b1, hit->b2);
        return false;
      },
      [&](std::uint32_t item) {
        find_in_item(world, item, ray, self, nearest);
        return false;
      });
}

/// Adds the transparent surfaces crossed before `limit`; stops and returns true at the first opaque one.
bool find_opaque(const Structure& structure, const OwnedTriangles& triangles, const World& world,
                 const PreparedRay& ray, const SurfaceId& self, double limit, Crossed& crossed) {
  if (structure.wide) return walk_to_opaque(*structure.wide, triangles, world, ray, self, limit, crossed);
  return search(
      *structure.plain, ray, [&] { return limit; },
      [&](std::uint32_t triangle) {
        const SurfaceId surface = triangles.surface(triangle);
        if (self == surface || !intersect(triangles[triangle], ray, limit)) return false;
        if (world.items[surface.item].is_opaque) return true;
        crossed.add(surface.item);
        return false;
      },
      [&](std::uint32_t item) { return cross_item(world, item, ray, self, limit, crossed); });
}

/// Adds the transparent items without a bound that are crossed; false if one is opaque.
bool cross_infinite(const World& world, const PreparedRay& ray, const SurfaceId& self, double limit, Crossed& crossed) {
  return std::ranges::none_of(world.infinite_items,
                              [&](std::uint32_t item) { return cross_item(world, item, ray, self, limit, crossed); });
}

bool cross(const World& world, const PreparedRay& ray, const SurfaceId& self, double limit, Crossed& crossed) {
  return cross_infinite(world, ray, self, limit, crossed) &&
         !find_opaque(world.structure, OwnedTriangles(world), world, ray, self, limit, crossed);
}

}  // namespace

void find_in_item(const World& world, std::uint32_t id, const PreparedRay& ray, const SurfaceId& self,
                  Nearest& nearest) {
  const Item& item = world.items[id];
  if (item.kind == Kind::mesh) {
    in_mesh_space(world, item, ray, [&](const MeshShape& mesh, const PreparedRay& local) {
      find_nearest(mesh.structure, OwnedTriangles(world, id), world, local, self, nearest);
    });
    return;
  }
  const Crossings found = world_crossings(world, item, ray, self_part(self, id));
  if (found.count > 0 && found.t[0] < nearest.limit) nearest.offer(found.t[0], {id, found.part[0]}, 0, 0);
}

bool cross_item(const World& world, std::uint32_t id, const PreparedRay& ray, const SurfaceId& self, double limit,
                Crossed& crossed) {
  const Item& item = world.items[id];
  if (item.kind == Kind::mesh) {
    return in_mesh_space(world, item, ray, [&](const MeshShape& mesh, const PreparedRay& local) {
      return find_opaque(mesh.structure, OwnedTriangles(world, id), world, local, self, limit, crossed);
    });
  }
  const Crossings found = world_crossings(world, item, ray, self_part(self, id));
  for (int i = 0; i < found.count && found.t[i] < limit; ++i) {
    if (item.is_opaque) return true;
    crossed.add(id);
  }
  return false;
}

const std::vector<std::uint32_t>& Crossed::sorted() {
  std::sort(items_.begin(), items_.end());
  return items_;
}

std::optional<Hit> closest_hit(const World& world, const Ray& ray, double limit) {
  const PreparedRay prepared(ray.origin, ray.direction);
  Nearest nearest{std::nullopt, limit};
  for (const std::uint32_t item : world.infinite_items) find_in_item(world, item, prepared, ray.self, nearest);
  find_nearest(world.structure, OwnedTriangles(world), world, prepared, ray.self, nearest);
  return nearest.hit;
}

void closest_hits(const World& world, std::span<const PreparedRay> rays, const SurfaceId& self,
                  std::optional<Hit>* hits) {
  std::array<Nearest, bundle_width> nearest;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    nearest[i].limit = HUGE_VAL;
    for (const std::uint32_t item : world.infinite_items) find_in_item(world, item, rays[i], self, nearest[i]);
  }
  const OwnedTriangles owned(world);
  if (world.structure.wide) {
    walk_to_nearest(*world.structure.wide, owned, world, rays, self, nearest.data());
  } else {
    for (std::size_t i = 0; i < rays.size(); ++i)
      find_nearest(world.structure, owned, world, rays[i], self, nearest[i]);
  }
  for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = nearest[i].hit;
}

bool cross_transparent(const World& world, const Ray& ray, double limit, Crossed& crossed) {
  return cross(world, PreparedRay(ray.origin, ray.direction), ray.self, limit, crossed);
}

unsigned cross_transparent(const World& world, std::span<const PreparedRay> rays, const SurfaceId& self, double limit,
                           Crossed* crossed) {
  unsigned through = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const bool is_through = world.structure.wide ? cross_infinite(world, rays[i], self, limit, crossed[i])
                                                 : cross(world, rays[i], self, limit, crossed[i]);
    through |= is_through ? 1u << i : 0;
  }
  if (!world.structure.wide || through == 0) return through;
  return through & ~walk_to_opaque(*world.structure.wide, OwnedTriangles(world), world, rays, self, limit, crossed);
}

bool cross_transparent(const World& world, const CellContents& contents, const Ray& ray, double limit,
                       Crossed& crossed) {
  const PreparedRay prepared(ray.origin, ray.direction);
  const OwnedTriangles owned(world);
  for (const std::uint32_t triangle : contents.triangles()) {
    if (!intersect(world.triangles[triangle], prepared, limit)) continue;
    const std::uint32_t item = owned.item(triangle);
    if (world.items[item].is_opaque) return false;
    crossed.add(item);
  }
  return std::ranges::none_of(contents.others(), [&](std::uint32_t item) {
    return cross_item(world, item, prepared, ray.self, limit, crossed);
  });
}

int count_crossings(const World& world, std::uint32_t id, const Ray& ray, double limit) {
  const PreparedRay prepared(ray.origin, ray.direction);
  const Crossings found = world_crossings(world, world.items[id], prepared, self_part(ray.self, id));
  return static_cast<int>(std::count_if(found.t, found.t + found.count, [&](double t) { return t < limit; }));
}

namespace {

geometry::SurfacePoint point_on_triangle(const TriangleSet& triangles, std::uint32_t index, const Hit& hit) {
  geometry::SurfacePoint point = point_on(triangles[index], hit.b1, hit.b2);
  if (triangles.normals.empty()) return point;
  const auto& [a, b, c] = triangles.corners[index];
  const Vec3 sum =
      triangles.normals[a] * (1 - hit.b1 - hit.b2) + triangles.normals[b] * hit.b1 + triangles.normals[c] * hit.b2;
  if (math::max_component(math::abs(sum)) > 0) point.shading_normal = math::normalize(sum);
  return point;
}

}  // namespace

geometry::SurfacePoint surface_at(const World& world, const Ray& ray, const Hit& hit) {
  const Item& item = world.items[hit.surface.item];
  if (item.kind == Kind::patch) return point_on_triangle(world.triangles, item.index + hit.surface.part, hit);
  const Placement* placement = item.placement == not_placed ? nullptr : &world.placements[item.placement];
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
      default:
        return geometry::surface_at(world.cylinders[item.index], near, hit.surface.part);
    }
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

}  // namespace penumbra::accel
