#pragma once
#include "engine/accel/bundle.h"
#include "engine/geometry/surface.h"

namespace penumbra::accel {

/// Triangles side by side, each with a place on it: the weights of its second and third vertex. Every lane is to be
/// filled.
struct TriangleLanes {
  alignas(64) double vertex[3][3][bundle_width];  // by vertex and axis
  alignas(64) double b1[bundle_width], b2[bundle_width];
  void set(std::size_t lane, const geometry::TriangleVertices& triangle, double weight1, double weight2) {
    const math::Vec3* vertices[3]{&triangle.v0, &triangle.v1, &triangle.v2};
    for (std::size_t v = 0; v < 3; ++v) {
      vertex[v][0][lane] = vertices[v]->x, vertex[v][1][lane] = vertices[v]->y, vertex[v][2][lane] = vertices[v]->z;
    }
    b1[lane] = weight1, b2[lane] = weight2;
  }
};

/// By axis.
struct PlaceLanes {
  alignas(64) double position[3][bundle_width], error[3][bundle_width], normal[3][bundle_width];
  geometry::SurfacePoint operator[](std::size_t i) const {
    const auto at = [i](const double(&rows)[3][bundle_width]) {
      return math::Vec3{rows[0][i], rows[1][i], rows[2][i]};
    };
    return {at(position), at(error), at(normal), at(normal)};
  }
};

/// What geometry::point_on finds for each, to the same bits.
void find_places(const TriangleLanes& triangles, PlaceLanes& places);

}  // namespace penumbra::accel
