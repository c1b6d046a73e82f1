#pragma once
#include <cstdint>
#include <limits>

#include "engine/math/constants.h"
#include "engine/math/error_free.h"
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

/// The points origin + t·direction with 0 < t < limit; the direction need not be unit. A limit that is finite is where
/// something lies that is looked at: a surface through it, within rounding, is not crossed there. `rounding` is what
/// the coordinates may be off, beyond a few roundings of their own.
struct Segment {
  Vec3 origin, direction;
  double limit = math::infinity;
  double rounding = 0;

  bool has_end() const { return limit < math::infinity; }
};

/// What the coordinates of a segment's end may be off by roundings of its own coordinates, and because it starts beside
/// its surface by some more.
inline double rounding_of_end(const Vec3& origin, const Vec3& direction, double limit) {
  return math::gamma(64) * (math::taxicab(origin) + math::taxicab(direction) * limit);
}

}  // namespace penumbra::geometry
