#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "engine/accel/triangle_set.h"
#include "engine/geometry/quadrics.h"
#include "engine/math/affine.h"
#include "engine/math/bounds.h"

namespace penumbra::accel {

using geometry::SurfaceId;
using math::Vec3;

class NormalCones;
class Tree;
class WideTree;

/// One of the two: a wide tree where single precision can hold the coordinates and the acceleration is bvh, else a
/// plain one.
struct Structure {
  std::shared_ptr<const Tree> plain;
  std::shared_ptr<const WideTree> wide;
  std::shared_ptr<const NormalCones> cones;  // of the wide one, where silhouettes are asked for
};

/// A triangle mesh in its own space, with the structure that finds its triangles; may be shared by many items.
struct MeshShape {
  TriangleSet triangles;
  Structure structure;
  math::Bounds bounds;
};

/// A patch is triangles of the world's own; a mesh has a structure of its own.
enum class Kind : std::uint8_t { patch, sphere, plane, tube, cylinder, mesh };

/// Whether a segment that leaves the surface on its outer side cannot meet it again.
constexpr bool is_convex(Kind kind) {
  switch (kind) {
    case Kind::sphere:
    case Kind::plane:
    case Kind::tube:
    case Kind::cylinder:
      return true;
    case Kind::patch:
    case Kind::mesh:
      break;
  }
  return false;
}

/// Rays are taken into the space of a placed item, where t keeps its meaning.
struct Placement {
  math::Affine local_to_world, world_to_local;
};
inline constexpr std::uint32_t no_item = 0xffffffff;
inline constexpr std::uint32_t no_placement = 0xffffffff;

/// One thing rays can meet. `index` points into the array of its kind – for a patch, to the first of its triangles –,
/// `placement` into World::placements. Patches and planes are never placed: their world-space values are exact enough.
struct Item {
  Kind kind = Kind::patch;
  bool is_opaque = true;
  std::uint32_t index = 0;
  std::uint32_t placement = no_placement;
};

/// Every surface of a scene, in the scene's order: an item's index is its SurfaceId::item, and decides ties; for a
/// patch or mesh SurfaceId::part is the triangle. Immutable once compiled; may be shared between threads.
struct World {
  std::vector<Item> items;
  bool is_opaque = true;                      // every item is
  TriangleSet triangles;                      // of patches
  std::vector<std::uint32_t> triangle_items;  // the patch each belongs to
  std::vector<geometry::SphereShape> spheres;
  std::vector<geometry::PlaneShape> planes;
  std::vector<geometry::TubeShape> tubes;
  std::vector<geometry::CylinderShape> cylinders;
  std::vector<MeshShape> meshes;
  std::vector<Placement> placements;
  Structure structure;  // over the finite items
  std::vector<std::uint32_t> infinite_items;
};

/// What the coordinates of a point may be off after a map, for each of its own off by up to `rounding` and no larger
/// than those of `reach`.
double rounding_after(const math::Affine& map, const Vec3& reach, double rounding);

/// Encloses everything in the structure; may be empty, or without end where there is no telling.
math::Bounds bounds_of(const Structure& structure);

/// Enclosing box of an item in world space, rounded outwards; nothing for an infinite one, or a patch.
std::optional<math::Bounds> bounds_of(const World& world, const Item& item);

}  // namespace penumbra::accel
