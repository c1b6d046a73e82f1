#pragma once
#include <cmath>
#include <cstdint>
#include <optional>

#include "engine/accel/queries.h"
#include "engine/accel/wide_tree.h"
#include "engine/accel/world.h"

namespace penumbra::accel {

/// The best hit so far. `limit` is just beyond its t, so that a hit at equal t still gets to compete.
struct Nearest {
  std::optional<Hit> hit;
  double limit;

  void offer(double t, SurfaceId surface, double b1, double b2) {
    if (hit && (t > hit->t || (t == hit->t && surface > hit->surface))) return;
    hit = Hit{t, surface, b1, b2};
    limit = std::nextafter(t, HUGE_VAL);
  }
};

/// Triangles and what they belong to: all of a mesh's to one item, the loose ones of a world to an item each.
struct OwnedTriangles {
  const TriangleSet& set;
  std::uint32_t item = not_placed;       // of a mesh
  const std::uint32_t* items = nullptr;  // of loose triangles
  bool are_opaque = true;                // of a mesh
  SurfaceId surface(std::uint32_t triangle) const {
    return items == nullptr ? SurfaceId{item, triangle} : SurfaceId{items[triangle], 0};
  }
};

/// An item of the tree that is not a triangle: `find_in_item` offers its nearest crossing, `cross_item` adds its
/// crossings and tells whether it is opaque and crossed.
void find_in_item(const World& world, std::uint32_t item, const geometry::PreparedRay& ray, const SurfaceId& self,
                  Nearest& nearest);
bool cross_item(const World& world, std::uint32_t item, const geometry::PreparedRay& ray, const SurfaceId& self,
                double limit, Crossed& crossed);

/// Offers every hit that could be the nearest. The ray is in the tree's space.
void walk_to_nearest(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                     const geometry::PreparedRay& ray, const SurfaceId& self, Nearest& nearest);
/// Adds the transparent surfaces crossed before `limit`; stops and returns true at the first opaque one.
bool walk_to_opaque(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                    const geometry::PreparedRay& ray, const SurfaceId& self, double limit, Crossed& crossed);

class Shaft;

class ShaftVisitor {
 public:
  virtual ~ShaftVisitor() = default;
  virtual bool triangle(std::uint32_t triangle) = 0;
  virtual bool other(std::uint32_t item) = 0;
};

/// Visits everything that the shaft may meet; true if the visitor ended it.
bool walk(const WideTree& tree, const Shaft& shaft, ShaftVisitor& visitor);

}  // namespace penumbra::accel
