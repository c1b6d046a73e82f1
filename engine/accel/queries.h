#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "engine/accel/cell.h"
#include "engine/accel/world.h"
#include "engine/geometry/ray.h"
#include "engine/geometry/surface.h"

namespace penumbra::accel {

using geometry::Ray;

/// The nearest crossing: t in units of the ray's direction; b1, b2 weigh the second and third vertex of a triangle.
struct Hit {
  double t = 0;
  SurfaceId surface;
  double b1 = 0, b2 = 0;
};

/// The nearest surface with 0 < t < limit. Of surfaces at the same t the one first in the scene wins, so the answer
/// does not depend on the structure.
std::optional<Hit> closest_hit(const World& world, const Ray& ray,
                               double limit = std::numeric_limits<double>::infinity());

inline constexpr std::size_t bundle_width = 8;
/// The same of up to bundle_width rays at once that leave `self`, with a place for each to find: rays that lie close
/// together and go into one octant share most of the way through the structure.
void closest_hits(const World& world, std::span<const geometry::PreparedRay> rays, const SurfaceId& self,
                  std::optional<Hit>* hits);

/// Position, normals and error bound at a hit of this ray.
geometry::SurfacePoint surface_at(const World& world, const Ray& ray, const Hit& hit);

/// The items a segment crosses, once per crossing.
class Crossed {
 public:
  void clear() { items_.clear(); }
  void add(std::uint32_t item) { items_.push_back(item); }
  /// In scene order, so that products over them round the same way whatever structure found them.
  const std::vector<std::uint32_t>& sorted();

 private:
  std::vector<std::uint32_t> items_;
};

/// Finds every crossing with 0 < t < limit of transparent items; stops and returns false at the first opaque one.
bool cross_transparent(const World& world, const Ray& ray, double limit, Crossed& crossed);

/// The same of a bundle, as for closest_hits, with a list for each ray. Returns those that met nothing opaque, one bit
/// each.
unsigned cross_transparent(const World& world, std::span<const geometry::PreparedRay> rays, const SurfaceId& self,
                           double limit, Crossed* crossed);

/// The same for a segment from a point of a cell to one of its target, whose contents are listed.
bool cross_transparent(const World& world, const CellContents& contents, const Ray& ray, double limit,
                       Crossed& crossed);

/// How often the ray crosses `item` (a part of it, for a mesh) with 0 < t < limit.
int count_crossings(const World& world, std::uint32_t item, const Ray& ray, double limit);

}  // namespace penumbra::accel
