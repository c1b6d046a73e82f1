#include "engine/accel/queries.h"

#include <algorithm>

#include "engine/accel/slab.h"
#include "engine/accel/tree.h"
#include "engine/accel/wide_walk.h"
#include "engine/math/constants.h"

namespace penumbra::accel {
namespace {

using geometry::Crossings;
using geometry::PreparedRay;
using geometry::Segment;
using geometry::SelfPart;

/// What coordinates of points between the ray's origin and t = 1 may be off in the space of a placement.
double rounding_in(const math::Affine& world_to_local, const PreparedRay& ray) {
  return rounding_after(world_to_local, math::abs(ray.origin) + math::abs(ray.direction), 0);
}

SelfPart self_part(const SurfaceId& self, std::uint32_t item) {
  return self.item == item ? SelfPart{self.part} : std::nullopt;
}

/// Of a quadric or plane, in the item's own space. Triangles are not met this way.
Crossings local_crossings(const World& world, const Item& item, const Segment& segment, SelfPart self) {
  switch (item.kind) {
    case Kind::sphere:
      return crossings(world.spheres[item.index], segment, self);
    case Kind::plane:
      return crossings(world.planes[item.index], segment, self);
    case Kind::tube:
      return crossings(world.tubes[item.index], segment, self);
    case Kind::cylinder:
      return crossings(world.cylinders[item.index], segment, self);
    case Kind::patch:
    case Kind::mesh:
      break;
  }
  return {};
}

Crossings world_crossings(const World& world, const Item& item, const PreparedRay& ray, double limit, SelfPart self) {
  if (item.placement == no_placement) return local_crossings(world, item, {ray.origin, ray.direction, limit}, self);
  const math::Affine& map = world.placements[item.placement].world_to_local;
  const double rounding = limit < math::infinity ? rounding_in(map, ray) : 0;
  return local_crossings(world, item, {map.point(ray.origin), map.vector(ray.direction), limit, rounding}, self);
}

/// Visits leaves nearest first until one returns true; `limit()` may shrink on the way.
template <class Limit, class Leaf>
bool visit_in_order(const Tree& tree, const Tree::Node& node, const PreparedRay& ray, const Limit& limit,
                    const Leaf& test_leaf) {
  if (node.is_leaf()) return test_leaf(node);
  const auto children = tree.children(node);
  if (children.size() != 2) {
    return std::any_of(children.begin(), children.end(), [&](const Tree::Node& child) {
      return enter(child.box, ray, limit()) < math::infinity && visit_in_order(tree, child, ray, limit, test_leaf);
    });
  }
  const double first = enter(children[0].box, ray, limit()), second = enter(children[1].box, ray, limit());
  const std::size_t near = second < first ? 1 : 0;
  const double near_t = std::min(first, second), far_t = std::max(first, second);
  if (near_t == math::infinity) return false;
  if (visit_in_order(tree, children[near], ray, limit, test_leaf)) return true;
  return far_t < limit() && visit_in_order(tree, children[1 - near], ray, limit, test_leaf);
}

/// Calls at_triangle(index) and at_other(id) for what the ray may meet before `limit()`, roughly nearest first, until
/// one returns true; tells whether one did.
template <class Limit, class AtTriangle, class AtOther>
bool search(const Tree& tree, const PreparedRay& ray, const Limit& limit, const AtTriangle& at_triangle,
            const AtOther& at_other) {
  return enter(tree.root().box, ray, limit()) < math::infinity &&
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
          nearest.offer({hit->t, surface, hit->b1, hit->b2});
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
        if (self == surface || !crosses(triangles[triangle], ray, limit)) return false;
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

geometry::PreparedRay to_local(const Placement& placement, const PreparedRay& ray) {
  const math::Affine& map = placement.world_to_local;
  PreparedRay local(map.point(ray.origin), map.vector(ray.direction));
  local.rounding = rounding_in(map, ray);
  return local;
}

void find_in_item(const World& world, std::uint32_t id, const PreparedRay& ray, const SurfaceId& self,
                  Nearest& nearest) {
  const Item& item = world.items[id];
  if (item.kind == Kind::mesh) {
    in_mesh_space(world, item, ray, [&](const MeshShape& mesh, const PreparedRay& local) {
      find_nearest(mesh.structure, OwnedTriangles(world, id), world, local, self, nearest);
    });
    return;
  }
  const Crossings found = world_crossings(world, item, ray, math::infinity, self_part(self, id));
  if (found.count > 0) nearest.offer({found.t[0], {id, found.part[0]}});
}

bool cross_item(const World& world, std::uint32_t id, const PreparedRay& ray, const SurfaceId& self, double limit,
                Crossed& crossed) {
  const Item& item = world.items[id];
  if (item.kind == Kind::mesh) {
    return in_mesh_space(world, item, ray, [&](const MeshShape& mesh, const PreparedRay& local) {
      return find_opaque(mesh.structure, OwnedTriangles(world, id), world, local, self, limit, crossed);
    });
  }
  const Crossings found = world_crossings(world, item, ray, limit, self_part(self, id));
  if (found.count > 0 && item.is_opaque) return true;
  for (int i = 0; i < found.count; ++i) crossed.add(id);
  return false;
}

std::optional<Hit> closest_hit(const World& world, const Ray& ray, double limit) {
  const PreparedRay prepared(ray.origin, ray.direction);
  Nearest nearest(limit);
  for (const std::uint32_t item : world.infinite_items) find_in_item(world, item, prepared, ray.self, nearest);
  find_nearest(world.structure, OwnedTriangles(world), world, prepared, ray.self, nearest);
  return first_met(world, prepared, nearest);
}

unsigned closest_hits(const World& world, const Bundle& bundle, Hit* hits) {
  std::array<Nearest, bundle_width> nearest;
  const bool is_wide = world.structure.wide != nullptr, is_alone = !is_wide || !world.infinite_items.empty();
  const OwnedTriangles owned(world);
  for (std::size_t i = 0; i < bundle.size() && is_alone; ++i) {
    const PreparedRay ray = bundle.prepared(i);
    for (const std::uint32_t item : world.infinite_items) find_in_item(world, item, ray, bundle.self(i), nearest[i]);
    if (!is_wide) find_nearest(world.structure, owned, world, ray, bundle.self(i), nearest[i]);
  }
  if (is_wide) walk_to_nearest(*world.structure.wide, owned, world, bundle, nearest.data());
  unsigned met = 0;
  for (std::size_t i = 0; i < bundle.size(); ++i) {
    const std::span<const Hit> found = nearest[i].hits();
    if (found.empty()) continue;
    met |= 1u << i;
    hits[i] = found.size() == 1 ? found.front() : *first_met(world, bundle.prepared(i), nearest[i]);
  }
  return met;
}

bool cross_transparent(const World& world, const Ray& ray, double limit, Crossed& crossed) {
  return cross(world, PreparedRay(ray.origin, ray.direction), ray.self, limit, crossed);
}

unsigned cross_transparent(const World& world, const Bundle& bundle, double limit, Crossed* crossed) {
  const bool is_wide = world.structure.wide != nullptr;
  unsigned through = (1u << bundle.size()) - 1;
  for (std::size_t i = 0; i < bundle.size() && !(is_wide && world.infinite_items.empty()); ++i) {
    const PreparedRay ray = bundle.prepared(i);
    const bool is_through = is_wide ? cross_infinite(world, ray, bundle.self(i), limit, crossed[i])
                                    : cross(world, ray, bundle.self(i), limit, crossed[i]);
    if (!is_through) through &= ~(1u << i);
  }
  if (!is_wide || through == 0) return through;
  return through & ~walk_to_opaque(*world.structure.wide, OwnedTriangles(world), world, bundle, limit, crossed);
}

int count_crossings(const World& world, std::uint32_t id, const Ray& ray, double limit) {
  const PreparedRay prepared(ray.origin, ray.direction);
  return world_crossings(world, world.items[id], prepared, limit, self_part(ray.self, id)).count;
}

}  // namespace penumbra::accel
