#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "engine/scene/description.h"

namespace penumbra::bench {

using math::Vec3;

/// Of the vertices of a smooth triangle.
using FlatNormals = std::array<Vec3, 3>;
constexpr std::uint32_t no_normals = 0xffffffff;

struct FlatTriangle {
  Vec3 vertices[3];
  std::uint32_t material;
  std::uint32_t normals = no_normals;  // index into FlatScene::normals
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

/// One of FlatScene::meshes at a place of its own; opaque.
struct FlatInstance {
  std::uint32_t mesh;
  std::uint32_t material;
  math::Affine to_world, to_mesh;
};

/// A scene as a peer sees it: world-space shapes, one list a kind, and meshes that are there many times.
struct FlatScene {
  std::vector<FlatTriangle> triangles;
  std::vector<FlatSphere> spheres;
  std::vector<FlatCylinder> cylinders;
  std::vector<FlatNormals> normals;
  std::vector<std::vector<FlatTriangle>> meshes;
  std::vector<FlatInstance> instances;
};

/// Everything in `description`, transforms applied. Throws std::invalid_argument for what the benchmark's peers do not
/// know: planes, tubes, transformed quadrics, transparent instances.
FlatScene flatten(const scene::Description& description);

}  // namespace penumbra::bench
