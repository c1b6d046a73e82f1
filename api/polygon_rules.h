#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "engine/math/vec3.h"

namespace penumbra::api {

/// How far, relative to the longest side of its box, a polygon's vertices may lie from its plane.
inline constexpr double planarity_tolerance = 1e-6;

struct PolygonFault {
  std::optional<std::size_t> vertex;  // the one to blame, where it is one
  std::string detail;
};

/// Why `vertices` (at least 3) are no polygon, if they are none: it must be in one plane (through the centroid, with
/// Newell's normal), enclose an area, and not touch, cross or run back along itself.
std::optional<PolygonFault> polygon_fault(std::span<const math::Vec3> vertices);

}  // namespace penumbra::api
