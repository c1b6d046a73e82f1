#pragma once
#include <vector>

#include "engine/accel/wide_tree.h"

namespace penumbra::accel {

/// For every child of a tree's nodes a cone around the normals of the triangles there and of their neighbours, and for
/// every triangle of its blocks its neighbours themselves: where all face a point, or all face away, no edge there is a
/// silhouette seen from it.
class NormalCones {
 public:
  /// By lane: axis (unit), cosine and sine of the half-angle, below a right angle; a lane that tells nothing – a
  /// triangle has an edge without neighbour, or normals point all ways – has a cosine that is no number.
  struct Cones {
    alignas(32) float axis[3][WideTree::width], cosine[WideTree::width], sine[WideTree::width];
  };

  /// By edge, axis and lane, relative to the tree's origin: the vertex of the neighbour across, as precise as those of
  /// a block; no numbers where there is none.
  struct Flanks {
    alignas(32) float vertex[3][3][WideTree::width];
  };

  NormalCones() = default;
  /// The triangles' neighbours must be known.
  NormalCones(const WideTree& tree, const TriangleSet& triangles, const ParallelFor& parallel_for);

  const Cones& of_node(std::uint32_t index) const { return of_nodes_[index]; }
  const Flanks& beside_block(std::uint32_t index) const { return beside_blocks_[index]; }

 private:
  std::vector<Cones> of_nodes_;
  std::vector<Flanks> beside_blocks_;
};

}  // namespace penumbra::accel
