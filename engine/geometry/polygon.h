#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "engine/math/vec3.h"

namespace penumbra::geometry {

/// Splits a planar simple polygon, convex or not, into vertices.size() − 2 triangles of the same winding (fewer where
/// vertices are collinear), by ear clipping. Indices into `vertices`.
std::vector<std::array<std::uint32_t, 3>> triangulate(const std::vector<math::Vec3>& vertices);

}  // namespace penumbra::geometry
