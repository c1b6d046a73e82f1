#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/geometry/triangle.h"
#include "engine/math/bounds.h"

namespace penumbra::accel {

/// Triangles by shared vertices, counter-clockwise seen from outside.
struct TriangleSet {
  std::vector<math::Vec3> positions;
  std::vector<std::array<std::uint32_t, 3>> corners;
  std::vector<math::Vec3> normals;  // by vertex: unit ones, mapped, or zero; none at all if every face is flat
  /// Across the edges from corner 0 to 1, 1 to 2 and 2 to 0; filled where silhouettes are asked for (neighbours.h).
  std::vector<std::array<std::uint32_t, 3>> neighbours;
  static constexpr std::uint32_t no_neighbour = 0xffffffff;

  std::size_t size() const { return corners.size(); }
  geometry::TriangleVertices operator[](std::uint32_t index) const {
    const auto& [a, b, c] = corners[index];
    return {positions[a], positions[b], positions[c]};
  }
  math::Bounds bounds_of(std::uint32_t index) const {
    math::Bounds box;
    for (const std::uint32_t corner : corners[index]) box.include(positions[corner]);
    return box;
  }
};

}  // namespace penumbra::accel
