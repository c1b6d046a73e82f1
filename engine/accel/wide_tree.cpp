#include "engine/accel/wide_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace penumbra::accel {
namespace {

float rounded_down(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) <= x ? f : std::nextafter(f, -HUGE_VALF);
}
float rounded_up(double x) { return -rounded_down(-x); }

}  // namespace

bool WideTree::can_hold(const math::Bounds& bounds) {
  return math::max_component(math::max(math::abs(bounds.lower), math::abs(bounds.upper))) < 1e15;
}

WideTree::WideTree(const Tree& tree) {
  // Where children are missing: an empty leaf. A ray that is no number enters every box.
  leaves_.push_back({0, 0, 0, 0});
  const std::uint32_t root = add(tree, tree.root());
  if ((root & leaf_flag) == 0) return;
  // The walk starts at node 0: a tree that is one leaf gets a node around it.
  nodes_.emplace_back();
  Node& node = nodes_.back();
  for (std::size_t i = 0; i < width; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      node.bounds[axis][i] = i == 0 ? rounded_down(tree.root().box.lower[axis]) : HUGE_VALF;
      node.bounds[axis + 3][i] = i == 0 ? rounded_up(tree.root().box.upper[axis]) : -HUGE_VALF;
    }
    node.child[i] = i == 0 ? root : leaf_flag;
  }
}

std::uint32_t WideTree::add(const Tree& tree, const Tree::Node& node) {
  if (node.is_leaf()) return add_leaf(tree, node);
  std::vector<const Tree::Node*> children;
  for (const Tree::Node& child : tree.children(node)) children.push_back(&child);
  // Open the child a ray is most likely to enter, while there is room.
  while (children.size() < width) {
    const auto largest =
        std::max_element(children.begin(), children.end(), [](const Tree::Node* a, const Tree::Node* b) {
          const auto area = [](const Tree::Node* n) { return n->is_leaf() ? -1 : n->box.half_area(); };
          return area(a) < area(b);
        });
    if ((*largest)->is_leaf()) break;
    const auto grandchildren = tree.children(**largest);
    *largest = &grandchildren[0];
    children.push_back(&grandchildren[1]);
  }
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  for (std::size_t i = 0; i < width; ++i) {
    const bool is_used = i < children.size();
    for (int axis = 0; axis < 3; ++axis) {
      nodes_[index].bounds[axis][i] = is_used ? rounded_down(children[i]->box.lower[axis]) : HUGE_VALF;
      nodes_[index].bounds[axis + 3][i] = is_used ? rounded_up(children[i]->box.upper[axis]) : -HUGE_VALF;
    }
    const std::uint32_t child = is_used ? add(tree, *children[i]) : leaf_flag;
    nodes_[index].child[i] = child;
  }
  return index;
}

std::uint32_t WideTree::add_leaf(const Tree& tree, const Tree::Node& node) {
  Leaf leaf;
  leaf.block_begin = static_cast<std::uint32_t>(blocks_.size());
  const auto triangles = tree.triangles(node);
  for (std::size_t first = 0; first < triangles.size(); first += block_width) {
    Block& block = blocks_.emplace_back();
    for (std::size_t lane = 0; lane < block_width; ++lane) {
      const bool is_used = first + lane < triangles.size();
      const LeafTriangle& triangle = triangles[is_used ? first + lane : first];
      // A triangle that is one point has no area and is never met.
      const Vec3 vertices[3]{triangle.vertices.v0, is_used ? triangle.vertices.v1 : triangle.vertices.v0,
                             is_used ? triangle.vertices.v2 : triangle.vertices.v0};
      for (std::size_t v = 0; v < 3; ++v) {
        for (std::size_t axis = 0; axis < 3; ++axis) block.vertex[v][axis][lane] = vertices[v][static_cast<int>(axis)];
      }
      block.id[lane] = triangle.id;
    }
  }
  leaf.block_end = static_cast<std::uint32_t>(blocks_.size());
  leaf.other_begin = static_cast<std::uint32_t>(others_.size());
  for (const std::uint32_t other : tree.others(node)) others_.push_back(other);
  leaf.other_end = static_cast<std::uint32_t>(others_.size());
  leaves_.push_back(leaf);
  return static_cast<std::uint32_t>(leaves_.size() - 1) | leaf_flag;
}

}  // namespace penumbra::accel
