#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/accel/half_spaces.h"
#include "engine/accel/hit.h"
#include "engine/accel/world.h"
#include "engine/geometry/ray.h"
#include "engine/shading/shadows/silhouettes.h"
#include "engine/shading/shadows/sphere_list.h"

namespace penumbra::shading::shadows {

using accel::HalfSpaces;
using accel::World;

/// A parallelogram of lit points that share what may stand between them and a light.
struct FlatCell {
  std::array<Vec3, 4> corners;  // in order around it
  Vec3 up;                      // the normal of its plane, unit, on the lit side
};

/// A ball that holds lit points.
struct RoundCell {
  Vec3 center;
  double radius = 0;
};

/// What the points are lit from: a ball around a point or, infinitely far, around a direction.
struct Target {
  Vec3 center;
  double radius = 0;
  bool is_infinite = false;
  double lead = 0;  // outlines are of what lies so far before the middle, as seen from everywhere in a cell
};

/// What the opaque triangles between a cell and a target may show of a silhouette, and the spheres there.
struct Outline {
  EdgeList edges;
  SphereList spheres;          // opaque, not placed
  bool has_triangles = false;  // there may be some, though they need not show an edge
};

/// What may cross a segment from a point of a cell to one of a target.
class CellContents {
 public:
  /// Nothing; one opaque triangle crosses every segment; the lists hold all that may cross one; not known.
  enum class Verdict : std::uint8_t { lit, dark, listed, unknown };

  CellContents() = default;  ///< Unknown.
  /// A verdict. Coplanar neighbours of the cell are left out: no segment that rises above a plane meets what does not.
  /// So is the item `self` if it is a plane.
  CellContents(const World& world, const FlatCell& cell, const Target& target, const SurfaceId& self);
  /// An outline, and no verdict, where there are not too many edges. The points lie on `self`, or on what surface they
  /// like.
  static CellContents outlined(const World& world, const FlatCell& cell, const Target& target, const SurfaceId& self);
  static CellContents outlined(const World& world, const RoundCell& cell, const Target& target);

  Verdict verdict() const { return verdict_; }
  bool tells_something() const { return verdict_ != Verdict::unknown || outline_; }
  /// Of World::triangles, and of World::items that are no patches; when listed. Beside an outline, no opaque triangles
  /// nor spheres of the outline's.
  std::span<const std::uint32_t> triangles() const { return {triangles_.data(), triangle_count_}; }
  std::span<const std::uint32_t> others() const { return others_; }
  /// Beside the lists of what else may cross a segment.
  const Outline* outline() const { return outline_ ? &*outline_ : nullptr; }

 private:
  class Search;
  class OutlineSearch;

  static constexpr std::size_t triangle_capacity = 24, other_capacity = 256, listed_others = 6;
  std::array<std::uint32_t, triangle_capacity> triangles_;
  std::vector<std::uint32_t> others_;
  std::uint8_t triangle_count_ = 0;
  Verdict verdict_ = Verdict::unknown;
  std::optional<Outline> outline_;
};

/// Finds every crossing with 0 < t < limit of transparent items on a segment from a point of a cell to one of its
/// target, whose contents are listed; stops and returns false at the first opaque one.
bool cross_transparent(const World& world, const CellContents& contents, const geometry::Ray& ray, double limit,
                       accel::Crossed& crossed);

/// The convex hull of cell and target, above the cell's plane; nothing if the target does not lie wholly above it.
std::optional<HalfSpaces> hull(const FlatCell& cell, const Target& target);
/// About the convex hull of cell and target; nothing if they are not apart.
std::optional<HalfSpaces> hull(const RoundCell& cell, const Target& target);

}  // namespace penumbra::shading::shadows
