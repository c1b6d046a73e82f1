#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/accel/tree.h"
#include "engine/geometry/triangle.h"

namespace penumbra::accel {

class Shaft;

/// A binary tree collapsed to eight children a node, for SIMD: boxes in single precision, rounded outwards, and leaf
/// triangles in blocks of four. It answers with a superset of what a ray can meet; the exact test of each shape
/// decides, so the structure changes no result. After Wald, Benthin, Boulos, "Getting Rid of Packets", 2008. Immutable;
/// may be shared between threads.
class WideTree {
 public:
  static constexpr std::size_t width = 8, block_width = 4;

  explicit WideTree(const Tree& tree);
  /// Single precision reaches that far with room for products.
  static bool can_hold(const math::Bounds& bounds);

  /// lower x, y, z, upper x, y, z of each child. Missing children are empty leaves in boxes that no
  /// ray meets.
  struct Node {
    alignas(32) float bounds[6][width];
    std::uint32_t child[width];  // a node's index, or a leaf's with `leaf_flag`
  };
  static constexpr std::uint32_t leaf_flag = 0x80000000u;

  struct Leaf {
    std::uint32_t block_begin, block_end, other_begin, other_end;
  };

  /// Four triangles, by vertex, axis and lane; unused lanes repeat a degenerate triangle.
  struct Block {
    alignas(32) double vertex[3][3][block_width];
    std::uint32_t id[block_width];
    geometry::TriangleVertices triangle(std::size_t lane) const {
      const auto v = [&](int i) { return Vec3{vertex[i][0][lane], vertex[i][1][lane], vertex[i][2][lane]}; };
      return {v(0), v(1), v(2)};
    }
  };

  const std::vector<Node>& nodes() const { return nodes_; }
  const Leaf& leaf(std::uint32_t reference) const { return leaves_[reference & ~leaf_flag]; }
  std::span<const Block> blocks(const Leaf& leaf) const {
    return {blocks_.data() + leaf.block_begin, blocks_.data() + leaf.block_end};
  }
  std::span<const std::uint32_t> others(const Leaf& leaf) const {
    return {others_.data() + leaf.other_begin, others_.data() + leaf.other_end};
  }

 private:
  std::uint32_t add(const Tree& tree, const Tree::Node& node);
  std::uint32_t add_leaf(const Tree& tree, const Tree::Node& node);

  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> others_;
};

/// What a walk through a tree meets. `limit` may be shortened by the callee, never lengthened.
class RayVisitor {
 public:
  explicit RayVisitor(double ray_limit) : limit(ray_limit) {}
  virtual ~RayVisitor() = default;
  /// A triangle the ray very likely crosses before `limit`. True ends the walk.
  virtual bool triangle(std::uint32_t id, const geometry::TriangleVertices& vertices) = 0;
  virtual bool other(std::uint32_t id) = 0;
  double limit;
};

/// Visits everything the ray may meet before visitor.limit, roughly nearest first; true if the visitor ended it.
bool walk(const WideTree& tree, const geometry::PreparedRay& ray, RayVisitor& visitor);

class ShaftVisitor {
 public:
  virtual ~ShaftVisitor() = default;
  virtual bool triangle(std::uint32_t id, const geometry::TriangleVertices& vertices) = 0;
  virtual bool other(std::uint32_t id) = 0;
};

/// Visits everything in a box that the shaft may meet; true if the visitor ended it.
bool walk(const WideTree& tree, const Shaft& shaft, ShaftVisitor& visitor);

}  // namespace penumbra::accel
