#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include "engine/accel/half_spaces.h"
#include "engine/accel/normal_cones.h"
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
    limit = math::next_up(t);
  }
};

/// Triangles and what they belong to: a mesh's to one item, the world's own to patches.
class OwnedTriangles {
 public:
  /// The world's own.
  explicit OwnedTriangles(const World& world) : set_(world.triangles), world_(world) {}
  /// Those of the mesh that is `item`.
  OwnedTriangles(const World& world, std::uint32_t item)
      : set_(world.meshes[world.items[item].index].triangles), world_(world), mesh_(item) {}

  geometry::TriangleVertices operator[](std::uint32_t triangle) const { return set_[triangle]; }
  SurfaceId surface(std::uint32_t triangle) const {
    if (mesh_ != none) return {mesh_, triangle};
    const std::uint32_t patch = world_.triangle_items[triangle];
    return {patch, triangle - world_.items[patch].index};
  }
  /// The triangle that is this surface, or `none`.
  std::uint32_t index(const SurfaceId& surface) const {
    if (mesh_ != none) return surface.item == mesh_ ? surface.part : none;
    if (surface.item >= world_.items.size() || world_.items[surface.item].kind != Kind::patch) return none;
    return world_.items[surface.item].index + surface.part;
  }
  std::uint32_t item(std::uint32_t triangle) const { return mesh_ != none ? mesh_ : world_.triangle_items[triangle]; }

  bool is_opaque(std::uint32_t triangle) const { return world_.is_opaque || world_.items[item(triangle)].is_opaque; }

  const TriangleSet& set() const { return set_; }

  static constexpr std::uint32_t none = 0xffffffff;

 private:
  const TriangleSet& set_;
  const World& world_;
  std::uint32_t mesh_ = none;
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

/// The same of up to bundle_width rays at once, which all leave `self`, with a place for each to find.
void walk_to_nearest(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                     std::span<const geometry::PreparedRay> rays, const SurfaceId& self, Nearest* nearest);
/// Likewise, with `crossed` for each; returns the rays that met something opaque, one bit each.
unsigned walk_to_opaque(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                        std::span<const geometry::PreparedRay> rays, const SurfaceId& self, double limit,
                        Crossed* crossed);

class RegionVisitor {
 public:
  virtual ~RegionVisitor() = default;
  /// Which edges may be silhouettes in the region; and whether the triangle lies within the region's limits for
  /// certain.
  struct EdgeFlags {
    std::array<bool, 3> edge;
    bool is_within_limits = false;
    bool operator[](std::size_t e) const { return edge[e]; }
  };
  virtual bool triangle(std::uint32_t triangle, const EdgeFlags& edges) = 0;
  virtual bool other(std::uint32_t item) = 0;
  /// Triangles were left out.
  virtual void without_silhouette() {}
};

/// To leave out triangles whose edges are surely no silhouettes in the region, seen from anywhere in a ball, if they
/// lie within the region's limits.
struct Silhouettes {
  const NormalCones& cones;
  Vec3 viewpoint;     // the middle of the ball
  double radius = 0;  // which holds every surface a viewpoint lies on
};

/// Visits everything that the region may meet; true if the visitor ended it.
bool walk(const WideTree& tree, const HalfSpaces& region, const Silhouettes* silhouettes, RegionVisitor& visitor);

}  // namespace penumbra::accel
