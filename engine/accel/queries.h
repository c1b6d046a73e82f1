#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "engine/accel/hit.h"
#include "engine/accel/world.h"
#include "engine/geometry/ray.h"
#include "engine/geometry/surface.h"
#include "engine/math/constants.h"

namespace penumbra::accel {

using geometry::Ray;

/// The nearest surface with 0 < t < limit. Of surfaces at the same t the one first in the scene wins, so the answer
/// does not depend on the structure.
std::optional<Hit> closest_hit(const World& world, const Ray& ray, double limit = math::infinity);

/// Up to bundle_width rays, and what each leaves: those that lie close together and go into one octant share most of
/// the way through the structure.
struct Bundle {
  std::span<const geometry::PreparedRay> rays;
  const SurfaceId* selves;
};

/// The same of a bundle, with a place for each ray to find.
void closest_hits(const World& world, const Bundle& bundle, std::optional<Hit>* hits);

/// Position, normals and error bound at a hit of this ray.
geometry::SurfacePoint surface_at(const World& world, const Ray& ray, const Hit& hit);

/// Finds every crossing with 0 < t < limit of transparent items; stops and returns false at the first opaque one.
bool cross_transparent(const World& world, const Ray& ray, double limit, Crossed& crossed);

/// The same of a bundle, with a list for each ray. Returns those that met nothing opaque, one bit each.
unsigned cross_transparent(const World& world, const Bundle& bundle, double limit, Crossed* crossed);

/// How often the ray crosses `item` (a part of it, for a mesh) with 0 < t < limit.
int count_crossings(const World& world, std::uint32_t item, const Ray& ray, double limit);

}  // namespace penumbra::accel
