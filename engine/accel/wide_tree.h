#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "engine/accel/parallel.h"
#include "engine/accel/triangle_set.h"
#include "engine/geometry/quadrics.h"
#include "engine/math/bounds.h"

namespace penumbra::accel {

using math::Vec3;

/// Something else than a triangle that a tree is built over; `sphere` is set if it is one, in the tree's own space.
struct OtherEntry {
  math::Bounds box;
  std::uint32_t item = 0;
  const geometry::SphereShape* sphere = nullptr;
};

/// A bounding volume hierarchy with eight children a node, for SIMD: boxes and leaves in single precision, relative to
/// the tree's middle, rounded outwards. It answers with a superset of what a ray can meet, or with what is certain
/// whatever the rounding; each shape's own test in double precision decides the rest, so the structure changes no
/// result. After Wald, Benthin, Boulos, "Getting Rid of Packets", 2008. Immutable; may be shared between threads.
class WideTree {
 public:
  static constexpr std::size_t width = 8;
  /// Of pending children in a walk: the depth is bounded by 48 levels of any split and 32 that halve the entries, and a
  /// level leaves at most 7 siblings behind.
  static constexpr std::size_t stack_size = 7 * (48 + 32) + 8;

  WideTree() = default;  ///< Empty.
  /// Binned surface area heuristic (Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007). The
  /// same tree whatever `parallel_for` does.
  WideTree(const TriangleSet& triangles, std::span<const OtherEntry> others, const ParallelFor& parallel_for);

  /// Whether single precision reaches that far with room for products, and rounds more than double precision does so
  /// far from the origin: else what looks certain here may be in doubt there.
  static bool can_hold(const math::Bounds& bounds);

  /// lower x, y, z, upper x, y, z of each child. Missing children have boxes that nothing meets, and lead to an empty
  /// leaf.
  struct Node {
    alignas(64) float bounds[6][width];
    std::uint32_t child[width];
  };

  /// A child: what it is, and its index among those of its sort.
  enum class Sort : std::uint32_t { node, triangle_block, sphere_block, leaf };
  static constexpr std::uint32_t reference(Sort sort, std::size_t index) {
    return static_cast<std::uint32_t>(sort) << 30 | static_cast<std::uint32_t>(index);
  }
  static constexpr Sort sort_of(std::uint32_t reference) { return static_cast<Sort>(reference >> 30); }
  static constexpr std::uint32_t index_of(std::uint32_t reference) { return reference & 0x3fffffffu; }

  /// Triangles by vertex, axis and lane; vertices of unused lanes are no numbers.
  struct TriangleBlock {
    alignas(64) float vertex[3][3][width];
    std::uint32_t triangle[width];
  };
  /// Center and radius by lane; those of unused lanes are no numbers.
  struct SphereBlock {
    alignas(64) float center[3][width], radius[width];
    std::uint32_t item[width];
  };
  /// What does not fit one block.
  struct Leaf {
    std::uint32_t triangle_begin, triangle_end, sphere_begin, sphere_end, other_begin, other_end;
  };

  std::uint32_t root() const { return root_; }
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<TriangleBlock>& triangle_blocks() const { return triangle_blocks_; }
  const std::vector<SphereBlock>& sphere_blocks() const { return sphere_blocks_; }
  const std::vector<Leaf>& leaves() const { return leaves_; }
  const std::vector<std::uint32_t>& others() const { return others_; }
  /// What coordinates in single precision are relative to: where most entries are.
  const Vec3& origin() const { return origin_; }
  /// Largest coordinate of anything in the tree, relative to `origin`.
  double reach() const { return reach_; }
  const math::Bounds& bounds() const { return bounds_; }

 private:
  friend class WideBuilder;
  std::vector<Node> nodes_;
  std::vector<TriangleBlock> triangle_blocks_;
  std::vector<SphereBlock> sphere_blocks_;
  std::vector<Leaf> leaves_;
  std::vector<std::uint32_t> others_;
  std::uint32_t root_ = 0;
  Vec3 origin_;
  double reach_ = 0;
  math::Bounds bounds_;
};

/// `x` to single precision, downwards or upwards.
inline float rounded_down(double x) {
  constexpr float largest = std::numeric_limits<float>::max();
  const auto f = static_cast<float>(std::min<double>(x, largest));
  return f - std::fabs(f) * 0x1p-23F - std::numeric_limits<float>::min();
}
inline float rounded_up(double x) { return -rounded_down(-x); }

}  // namespace penumbra::accel
