#include "engine/accel/tree.h"

#include <algorithm>

#include "engine/math/constants.h"

namespace penumbra::accel {
namespace {

math::Bounds everywhere() {
  constexpr double inf = math::infinity;
  return {{-inf, -inf, -inf}, {inf, inf, inf}};
}

}  // namespace

Tree::Tree(scene::Acceleration acceleration, std::span<const TreeEntry> entries, const Grouping& grouping) {
  std::vector<Reference> references;
  references.reserve(entries.size());
  for (std::uint32_t i = 0; i < entries.size(); ++i) {
    references.push_back({entries[i].box, entries[i].box.center(), i});
  }
  nodes_.emplace_back();
  switch (acceleration) {
    case scene::Acceleration::none:
      make_leaf(0, references, entries);
      nodes_[0].box = everywhere();
      break;
    case scene::Acceleration::cbr: {
      Grouping flat;
      for (std::uint32_t i = 0; i < entries.size(); ++i) flat.entries.push_back(i);
      build_groups(0, flat, entries);
      break;
    }
    case scene::Acceleration::groups:
      build_groups(0, grouping, entries);
      break;
    case scene::Acceleration::median:
    case scene::Acceleration::bvh:
      build_halves(0, references, entries);
      break;
  }
}

void Tree::make_leaf(std::uint32_t node, std::span<const Reference> references, std::span<const TreeEntry> entries) {
  Node& leaf = nodes_[node];
  leaf.begin = static_cast<std::uint32_t>(triangles_.size());
  leaf.other_begin = static_cast<std::uint32_t>(others_.size());
  for (const Reference& reference : references) {
    const TreeEntry& entry = entries[reference.entry];
    (entry.is_triangle ? triangles_ : others_).push_back(entry.id);
  }
  leaf.end = static_cast<std::uint32_t>(triangles_.size());
  leaf.other_end = static_cast<std::uint32_t>(others_.size());
}

void Tree::build_groups(std::uint32_t node, const Grouping& grouping, std::span<const TreeEntry> entries) {
  const auto first = static_cast<std::uint32_t>(nodes_.size());
  const std::size_t count = grouping.entries.size() + grouping.groups.size();
  nodes_[node].begin = first;
  nodes_[node].end = first + static_cast<std::uint32_t>(count);
  nodes_[node].other_begin = inner_mark;
  nodes_.resize(nodes_.size() + count);
  math::Bounds box;
  std::uint32_t at = first;
  for (const std::uint32_t entry : grouping.entries) {
    const Reference reference{entries[entry].box, {}, entry};
    nodes_[at].box = reference.box;
    make_leaf(at++, {&reference, 1}, entries);
    box.include(reference.box);
  }
  for (const Grouping& group : grouping.groups) {
    build_groups(at, group, entries);
    box.include(nodes_[at++].box);
  }
  nodes_[node].box = box;
}

void Tree::build_halves(std::uint32_t node, std::span<Reference> references, std::span<const TreeEntry> entries) {
  math::Bounds box, centers;
  for (const Reference& r : references) box.include(r.box), centers.include(r.center);
  nodes_[node].box = box;
  if (references.size() <= 2) return make_leaf(node, references, entries);

  const Vec3 width = centers.extent();
  const int axis = width.x > width.y ? (width.x > width.z ? 0 : 2) : (width.y > width.z ? 1 : 2);
  const auto middle = references.begin() + static_cast<std::ptrdiff_t>(references.size() / 2);
  std::nth_element(references.begin(), middle, references.end(), [axis](const Reference& a, const Reference& b) {
    return a.center[axis] != b.center[axis] ? a.center[axis] < b.center[axis] : a.entry < b.entry;
  });
  const auto left = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[node].begin = left;
  nodes_[node].end = left + 2;
  nodes_[node].other_begin = inner_mark;
  build_halves(left, {references.begin(), middle}, entries);
  build_halves(left + 1, {middle, references.end()}, entries);
}

}  // namespace penumbra::accel
