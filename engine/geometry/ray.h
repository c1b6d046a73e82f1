#pragma once
#include <cstdint>
#include <limits>

#include "engine/math/vec3.h"

namespace penumbra::geometry {

using math::Vec3;

/// One surface of the compiled scene: the item's index in scene order and, inside an item, which part was met – a
/// triangle of an instanced mesh, the side or a cap of a cylinder.
struct SurfaceId {
  std::uint32_t item = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t part = 0;
  bool operator==(const SurfaceId&) const = default;
  auto operator<=>(const SurfaceId&) const = default;
};

/// Points origin + t·direction, t > 0; direction need not be unit. `self` is the surface the origin lies on: it is met
/// again only where the ray really comes back to it, never at the origin.
struct Ray {
  Vec3 origin, direction;
  SurfaceId self;
};

}  // namespace penumbra::geometry
