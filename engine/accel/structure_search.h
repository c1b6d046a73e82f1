#pragma once
#include <algorithm>

#include "engine/accel/tree.h"
#include "engine/accel/wide_walk.h"

namespace penumbra::accel {

/// Calls at_triangle(index, edges) and at_other(item) for what the region may meet, until one returns true; tells
/// whether one did. With `silhouettes`, triangles without one may be left out, which left_out() is told; `edges` of the
/// others may be silhouettes.
template <class AtTriangle, class AtOther, class LeftOut>
bool search(const Structure& structure, const HalfSpaces& region, const Silhouettes* silhouettes,
            const AtTriangle& at_triangle, const AtOther& at_other, const LeftOut& left_out) {
  if (structure.wide) {
    struct Visitor final : RegionVisitor {
      Visitor(const AtTriangle& t, const AtOther& o, const LeftOut& l) : at_triangle(t), at_other(o), left_out(l) {}
      bool triangle(std::uint32_t index, const EdgeFlags& edges) override { return at_triangle(index, edges); }
      bool other(std::uint32_t item) override { return at_other(item); }
      void without_silhouette() override { left_out(); }
      const AtTriangle& at_triangle;
      const AtOther& at_other;
      const LeftOut& left_out;
    } visitor(at_triangle, at_other, left_out);
    return walk(*structure.wide, region, silhouettes, visitor);
  }
  const Tree& tree = *structure.plain;
  const auto misses = [&](const math::Bounds& box) { return region.miss(box); };
  const auto at_any_edge = [&](std::uint32_t index) { return at_triangle(index, {true, true, true}); };
  auto at_leaf = [&](const Tree::Node& leaf) {
    return std::ranges::any_of(tree.triangles(leaf), at_any_edge) || std::ranges::any_of(tree.others(leaf), at_other);
  };
  return !misses(tree.root().box) && visit(tree, tree.root(), misses, at_leaf);
}

}  // namespace penumbra::accel
