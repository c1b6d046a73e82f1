#pragma once
#include <cstdint>
#include <span>

#include "engine/accel/triangle_set.h"

namespace penumbra::accel {

/// Fills `triangles.neighbours`: two triangles with the same group that run along an edge in opposite directions become
/// neighbours across it. Vertices at the same place count as one. `groups` has a number for each triangle; triangles of
/// group `no_group` get none.
inline constexpr std::uint32_t no_group = 0xffffffff;
void link_neighbours(TriangleSet& triangles, std::span<const std::uint32_t> groups);

}  // namespace penumbra::accel
