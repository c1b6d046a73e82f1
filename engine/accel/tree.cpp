#include "engine/accel/tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace penumbra::accel {
namespace {

constexpr int bin_count = 16;
// Beyond this depth splits fall back to the median, which bounds the depth of any tree by depth_of_sah + 32.
constexpr int depth_of_sah = 64;
// Costs of the surface area heuristic relative to one primitive's test.
constexpr double cost_of_node = 1.5, cost_of_entry = 1;

math::Bounds everywhere() {
  constexpr double inf = std::numeric_limits<double>::infinity();
  return {{-inf, -inf, -inf}, {inf, inf, inf}};
}

struct Split {
  int axis = -1;
  int bin = 0;  // entries in bins below go left
  double cost = std::numeric_limits<double>::infinity();
};

int bin_of(double centre, double lower, double scale) {
  return std::min(bin_count - 1, static_cast<int>((centre - lower) * scale));
}

double bin_scale(double width) { return bin_count / width; }

}  // namespace

Tree::Tree(scene::Acceleration acceleration, std::span<const TreeEntry> entries, const Grouping& grouping) {
  std::vector<Reference> references;
  references.reserve(entries.size());
  for (std::uint32_t i = 0; i < entries.size(); ++i) {
    references.push_back({entries[i].box, entries[i].box.centre(), i});
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
      build_binary(acceleration, 0, references, entries, 0);
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

void Tree::build_binary(scene::Acceleration acceleration, std::uint32_t node, std::span<Reference> references,
                        std::span<const TreeEntry> entries, int depth) {
  math::Bounds box, centres;
  for (const Reference& r : references) box.include(r.box), centres.include(r.centre);
  nodes_[node].box = box;
  if (references.size() <= 2) return make_leaf(node, references, entries);

  const Vec3 width = centres.extent();
  auto middle = references.begin();
  if (acceleration == scene::Acceleration::bvh && depth < depth_of_sah) {
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(width[axis] > 0) || !std::isfinite(bin_scale(width[axis]))) continue;
      struct Bin {
        math::Bounds box;
        std::size_t count = 0;
      };
      std::array<Bin, bin_count> bins;
      const double scale = bin_scale(width[axis]);
      for (const Reference& r : references) {
        Bin& bin = bins[static_cast<std::size_t>(bin_of(r.centre[axis], centres.lower[axis], scale))];
        bin.box.include(r.box), ++bin.count;
      }
      std::array<double, bin_count> cost_left{};
      math::Bounds side;
      std::size_t count = 0;
      for (std::size_t i = 0; i + 1 < bin_count; ++i) {
        side.include(bins[i].box), count += bins[i].count;
        cost_left[i + 1] = side.half_area() * static_cast<double>(count);
      }
      side = {}, count = 0;
      for (std::size_t i = bin_count - 1; i >= 1; --i) {
        side.include(bins[i].box), count += bins[i].count;
        const double cost = cost_left[i] + side.half_area() * static_cast<double>(count);
        if (count > 0 && count < references.size() && cost < best.cost) best = {axis, static_cast<int>(i), cost};
      }
    }
    const double area = box.half_area();
    const bool splitting_pays = best.axis >= 0 && cost_of_node * area + cost_of_entry * best.cost <
                                                      cost_of_entry * area * static_cast<double>(references.size());
    if (!splitting_pays && references.size() <= 8) return make_leaf(node, references, entries);
    if (best.axis >= 0) {
      const double scale = bin_scale(width[best.axis]);
      middle = std::partition(references.begin(), references.end(), [&](const Reference& r) {
        return bin_of(r.centre[best.axis], centres.lower[best.axis], scale) < best.bin;
      });
    }
  }
  if (middle == references.begin() || middle == references.end()) {
    const int axis = width.x > width.y ? (width.x > width.z ? 0 : 2) : (width.y > width.z ? 1 : 2);
    middle = references.begin() + static_cast<std::ptrdiff_t>(references.size() / 2);
    std::nth_element(references.begin(), middle, references.end(), [axis](const Reference& a, const Reference& b) {
      return a.centre[axis] != b.centre[axis] ? a.centre[axis] < b.centre[axis] : a.entry < b.entry;
    });
  }
  const auto left = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[node].begin = left;
  nodes_[node].end = left + 2;
  nodes_[node].other_begin = inner_mark;
  build_binary(acceleration, left, {references.begin(), middle}, entries, depth + 1);
  build_binary(acceleration, left + 1, {middle, references.end()}, entries, depth + 1);
}

}  // namespace penumbra::accel
