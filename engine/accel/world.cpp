#include "engine/accel/world.h"

#include <algorithm>

#include "engine/accel/tree.h"
#include "engine/accel/wide_tree.h"
#include "engine/math/error_free.h"

namespace penumbra::accel {
namespace {

math::Bounds transformed(const math::Bounds& box, const math::Affine& map) {
  const Vec3 center = map.point(box.center()), half = box.extent() * 0.5;
  const Vec3 reach =
      math::abs(map.column[0]) * half.x + math::abs(map.column[1]) * half.y + math::abs(map.column[2]) * half.z;
  const Vec3 margin = (math::abs(center) + reach + math::abs(map.translation)) * math::gamma(16);
  return {center - reach - margin, center + reach + margin};
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

double rounding_after(const math::Affine& map, const Vec3& reach, double rounding) {
  double size = math::taxicab(map.translation), stretch = 0;
  for (int i = 0; i < 3; ++i) {
    const double length = math::taxicab(map.column[i]);
    size += length * reach[i], stretch = std::max(stretch, length);
  }
  return math::gamma(8) * size + 3 * stretch * rounding;
}

math::Bounds bounds_of(const Structure& structure) {
  return structure.wide ? structure.wide->bounds() : structure.plain->root().box;
}

std::optional<math::Bounds> bounds_of(const World& world, const Item& item) {
  const std::optional<math::Bounds> box = local_bounds(world, item);
  if (!box || item.placement == no_placement) return box;
  return transformed(*box, world.placements[item.placement].local_to_world);
}

}  // namespace penumbra::accel
