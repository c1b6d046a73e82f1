#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/math/bounds.h"
#include "engine/scene/options.h"

namespace penumbra::accel {

using math::Vec3;

/// What a tree is built over: a box, and the caller's number for what is inside, a triangle or something else.
struct TreeEntry {
  math::Bounds box;
  std::uint32_t id = 0;
  bool is_triangle = false;
};

/// The scene's own hierarchy, for the `groups` acceleration: indices of entries, and groups inside.
struct Grouping {
  std::vector<std::uint32_t> entries;
  std::vector<Grouping> groups;
};

/// A bounding volume hierarchy over entries, in one array, for every acceleration of the contract but bvh, which has
/// its own for SIMD (WideTree) as long as single precision holds the coordinates. Immutable; may be shared between
/// threads.
class Tree {
 public:
  /// An inner node's children are nodes [begin, end); a leaf holds triangles [begin, end) and others
  /// [other_begin, other_end).
  struct Node {
    math::Bounds box;
    std::uint32_t begin = 0, end = 0, other_begin = 0, other_end = 0;
    bool is_leaf() const { return other_begin != inner_mark; }
  };
  static constexpr std::uint32_t inner_mark = 0xffffffff;

  /// none: one leaf without a box · cbr: a root with a leaf per entry · groups: `grouping` boxed, and a box per entry ·
  /// median, bvh: longest axis, median split, leaves ≤ 2.
  Tree(scene::Acceleration acceleration, std::span<const TreeEntry> entries, const Grouping& grouping = {});

  const Node& root() const { return nodes_.front(); }
  std::span<const Node> children(const Node& node) const {
    return {nodes_.data() + node.begin, nodes_.data() + node.end};
  }
  std::span<const std::uint32_t> triangles(const Node& leaf) const {
    return {triangles_.data() + leaf.begin, triangles_.data() + leaf.end};
  }
  std::span<const std::uint32_t> others(const Node& leaf) const {
    return {others_.data() + leaf.other_begin, others_.data() + leaf.other_end};
  }

 private:
  struct Reference {
    math::Bounds box;
    Vec3 center;
    std::uint32_t entry = 0;
  };
  void make_leaf(std::uint32_t node, std::span<const Reference> references, std::span<const TreeEntry> entries);
  void build_halves(std::uint32_t node, std::span<Reference> references, std::span<const TreeEntry> entries);
  void build_groups(std::uint32_t node, const Grouping& grouping, std::span<const TreeEntry> entries);

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> triangles_, others_;
};

/// Calls leaf(node) for every leaf that reject(box) does not cut off, until one returns true; tells whether one did.
template <class Reject, class Leaf>
bool visit(const Tree& tree, const Tree::Node& node, const Reject& reject, Leaf& leaf) {
  if (node.is_leaf()) return leaf(node);
  for (const Tree::Node& child : tree.children(node)) {
    if (!reject(child.box) && visit(tree, child, reject, leaf)) return true;
  }
  return false;
}

}  // namespace penumbra::accel
