#pragma once
#include <cstdint>
#include <vector>

#include "engine/scene/description.h"

namespace penumbra::bench {

using math::Vec3;

struct FlatTriangle {
  Vec3 vertices[3];
  std::uint32_t material;
};

struct FlatSphere {
  Vec3 center;
  double radius;
  std::uint32_t material;
};

/// An open cylinder from `from` to `to`: its ends lie inside other objects.
struct FlatCylinder {
  Vec3 from, to;
  double radius;
  std::uint32_t material;
};

/// A scene as a peer sees it: world-space shapes, one list a kind.
struct FlatScene {
  std::vector<FlatTriangle> triangles;
  std::vector<FlatSphere> spheres;
  std::vector<FlatCylinder> cylinders;
};

/// Everything in `description`, transforms applied. Throws std::invalid_argument for what the benchmark's peers do not
/// know: planes, tubes, smooth normals, transformed quadrics.
FlatScene flatten(const scene::Description& description);

}  // namespace penumbra::bench
