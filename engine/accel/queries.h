#pragma once
#include <cstdint>
#include <optional>

#include "engine/accel/bundle.h"
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

/// The same of a bundle, with a place for each ray's hit. Returns those that meet something, one bit each.
unsigned closest_hits(const World& world, const Bundle& bundle, Hit* hits);

/// Position, normals and error bound at a hit of this ray.
geometry::SurfacePoint surface_at(const World& world, const Ray& ray, const Hit& hit);

/// The same, to the same bits, of the rays of a bundle whose bits are set in `which`.
void surfaces_at(const World& world, const Bundle& bundle, unsigned which, const Hit* hits,
                 geometry::SurfacePoint* points);

/// Finds every crossing with 0 < t < limit of transparent items; stops and returns false at the first opaque one.
bool cross_transparent(const World& world, const Ray& ray, double limit, Crossed& crossed);

/// The same of a bundle, with a list for each ray. Returns those that met nothing opaque, one bit each.
unsigned cross_transparent(const World& world, const Bundle& bundle, double limit, Crossed* crossed);

/// How often the ray crosses `item` (a part of it, for a mesh) with 0 < t < limit.
int count_crossings(const World& world, std::uint32_t item, const Ray& ray, double limit);

}  // namespace penumbra::accel
