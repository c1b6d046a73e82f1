#include "engine/accel/world.h"

#include "engine/accel/tree.h"
#include "engine/accel/wide_tree.h"
#include "engine/math/error_free.h"

namespace penumbra::accel {
namespace {

math::Bounds transformed(const math::Bounds& box, const math::Affine& map) {
  const Vec3 centre = map.point(box.centre()), half = box.extent() * 0.5;
  const Vec3 reach =
      math::abs(map.column[0]) * half.x + math::abs(map.column[1]) * half.y + math::abs(map.column[2]) * half.z;
  const Vec3 margin = (math::abs(centre) + reach + math::abs(map.translation)) * math::gamma(16);
  return {centre - reach - margin, centre + reach + margin};
}

std::optional<math::Bounds> local_bounds(const World& world, const Item& item) {
  switch (item.kind) {
    case Kind::sphere:
      return geometry::bounds_of(world.spheres[item.index]);
    case Kind::plane:
      return geometry::bounds_of(world.planes[item.index]);
    case Kind::tube:
      return geometry::bounds_of(world.tubes[item.index]);
    case Kind::cylinder:
      return geometry::bounds_of(world.cylinders[item.index]);
    case Kind::mesh:
      return world.meshes[item.index].bounds;
    case Kind::patch:
      break;
  }
  return std::nullopt;
}

}  // namespace

math::Bounds bounds_of(const Structure& structure) {
  return structure.wide ? structure.wide->bounds() : structure.plain->root().box;
}

std::optional<math::Bounds> bounds_of(const World& world, const Item& item) {
  const std::optional<math::Bounds> box = local_bounds(world, item);
  if (!box || item.placement == not_placed) return box;
  return transformed(*box, world.placements[item.placement].local_to_world);
}

}  // namespace penumbra::accel
