#pragma once
#include <vector>

#include "engine/accel/wide_tree.h"

namespace penumbra::accel {

/// For every child of a tree's nodes and every triangle of its blocks, a cone around the normals of the triangles there
/// and of their neighbours: where all face a point, or all face away, no edge there is a silhouette seen from it.
class NormalCones {
 public:
  /// By lane: axis (unit), cosine and sine of the half-angle, below a right angle; a lane that tells nothing – a triangle
  /// has an edge without neighbour, or normals point all ways – has a cosine that is no number.
  struct Cones {
    alignas(32) float axis[3][WideTree::width], cosine[WideTree::width], sine[WideTree::width];
  };

  NormalCones() = default;
  /// The triangles' neighbours must be known.
  NormalCones(const WideTree& tree, const TriangleSet& triangles);

  bool is_empty() const { return of_blocks_.empty(); }
  const Cones& of_node(std::uint32_t index) const { return of_nodes_[index]; }
  const Cones& of_triangle_block(std::uint32_t index) const { return of_blocks_[index]; }

 private:
  std::vector<Cones> of_nodes_, of_blocks_;
};

}  // namespace penumbra::accel
