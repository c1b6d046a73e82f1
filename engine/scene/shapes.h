#pragma once
#include <array>
#include <cstdint>
#include <variant>
#include <vector>

#include "engine/math/affine.h"
#include "engine/math/vec3.h"
#include "engine/scene/material.h"

namespace penumbra::scene {

using math::Affine;
using math::Vec3;

struct Sphere {
  Vec3 center;
  double radius = 1;
};

/// Infinite; `normal` need not be unit.
struct Plane {
  Vec3 point, normal;
};

struct Triangle {
  std::array<Vec3, 3> vertices;
};

/// Planar and simple, convex or not; counter-clockwise seen from outside.
struct Polygon {
  std::vector<Vec3> vertices;
};

/// Infinite cylinder around the line point + t·direction; `direction` need not be unit.
struct Tube {
  Vec3 point, direction;
  double radius = 1;
};

/// `point` is the center of the base; `direction` need not be unit.
struct Cylinder {
  Vec3 point, direction;
  double radius = 1, height = 1;
  bool caps = true;
};

/// `normals` is empty (flat shading) or has one entry per position.
struct Mesh {
  std::vector<Vec3> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Vec3> normals;
};

/// Index into Description::meshes.
enum class MeshId : std::uint32_t {};

struct Instance {
  MeshId mesh{};
  Affine transform;
};

struct Object;

/// The grouping is what the `groups` acceleration uses.
struct Group {
  std::vector<Object> objects;
  Affine transform;
};

using Shape = std::variant<Sphere, Plane, Triangle, Polygon, Tube, Cylinder, Mesh, Instance, Group>;

/// `material` has no meaning for a group: its members have their own.
struct Object {
  Shape shape;
  MaterialId material{};
};

}  // namespace penumbra::scene
