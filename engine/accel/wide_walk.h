#pragma once
#include <algorithm>
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
#include "engine/math/constants.h"

namespace penumbra::accel {

/// The nearest hit so far, and those so near to it that they may be hits of surfaces that coincide: of these, which is
/// met depends on what they are. Whatever order they are offered in, the same are kept.
class Nearest {
 public:
  explicit Nearest(double limit_of_t = math::infinity) : limit(limit_of_t) {}

  /// Hits from there on are of no interest.
  double limit;
  void offer(const Hit& hit) {
    if (!(hit.t < limit)) return;
    if (count_ == 0 || hit.t < nearest_t_) narrow(hit.t);
    if (count_ == capacity) drop_farthest();
    hits_[count_++] = hit;
  }
  std::span<const Hit> hits() const { return {hits_.data(), count_}; }
  /// Of t: what is taken for rounding at most, and thereby how far apart hits of coinciding surfaces may be.
  static constexpr double most_error = 0x1p-24, band = 2 * most_error;

 private:
  static constexpr std::size_t capacity = 8;
  void narrow(double t) {
    nearest_t_ = t, limit = std::min(limit, math::next_up(t * (1 + band)));
    count_ = static_cast<std::size_t>(std::remove_if(hits_.begin(), hits_.begin() + static_cast<std::ptrdiff_t>(count_),
                                                     [&](const Hit& hit) { return !(hit.t < limit); }) -
                                      hits_.begin());
  }
  void drop_farthest() {
    const auto end = hits_.begin() + static_cast<std::ptrdiff_t>(count_);
    const auto is_nearer = [](const Hit& a, const Hit& b) { return a.t != b.t ? a.t < b.t : a.surface < b.surface; };
    std::swap(*std::max_element(hits_.begin(), end, is_nearer), hits_[--count_]);
  }

  union {  // not set before it is used
    std::array<Hit, capacity> hits_;
  };
  std::size_t count_ = 0;
  double nearest_t_ = 0;
};

/// Of surfaces that coincide, within rounding, with the nearest one, a ray meets an opaque one before any that
/// transmits, else the first in the scene.
std::optional<Hit> first_met(const World& world, const geometry::PreparedRay& ray, const Nearest& nearest);

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

/// The ray in the space of a placement.
geometry::PreparedRay to_local(const Placement& placement, const geometry::PreparedRay& ray);

/// Calls use(mesh, ray) with the ray in the mesh's space.
template <class Use>
auto in_mesh_space(const World& world, const Item& item, const geometry::PreparedRay& ray, const Use& use) {
  const MeshShape& mesh = world.meshes[item.index];
  if (item.placement == no_placement) return use(mesh, ray);
  return use(mesh, to_local(world.placements[item.placement], ray));
}

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

/// The same of a bundle, with a place for each ray to find.
void walk_to_nearest(const WideTree& tree, const OwnedTriangles& triangles, const World& world, const Bundle& bundle,
                     Nearest* nearest);
/// The same question as walk_to_opaque, with a `crossed` for each ray; returns the rays that met something opaque, one
/// bit each.
unsigned walk_to_opaque(const WideTree& tree, const OwnedTriangles& triangles, const World& world, const Bundle& bundle,
                        double limit, Crossed* crossed);

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
