#include "engine/accel/neighbours.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

namespace penumbra::accel {
namespace {

/// Open addressing over indices; `hash` and `equal` look at what an index stands for.
class IndexTable {
 public:
  explicit IndexTable(std::size_t entries) : slots_(std::bit_ceil(2 * entries + 2), none) {}

  /// The index equal to `index` that was added first: perhaps itself, now.
  template <class Equal>
  std::uint32_t add(std::uint32_t index, std::uint64_t hash, const Equal& equal) {
    for (std::size_t slot = scattered(hash);; ++slot) {
      std::uint32_t& found = slots_[slot & (slots_.size() - 1)];
      if (found == none) return found = index;
      if (equal(found, index)) return found;
    }
  }

 private:
  static constexpr std::uint32_t none = 0xffffffff;
  static std::size_t scattered(std::uint64_t x) {
    x *= 0x9e3779b97f4a7c15u;
    return x ^ x >> 32;
  }
  std::vector<std::uint32_t> slots_;
};

/// For each vertex the first one at the same place.
std::vector<std::uint32_t> welded(const std::vector<math::Vec3>& positions) {
  IndexTable table(positions.size());
  std::vector<std::uint32_t> first(positions.size());
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    std::uint64_t hash = 0;
    for (int axis = 0; axis < 3; ++axis) {
      // −0 is at the place of 0.
      hash = (hash ^ std::bit_cast<std::uint64_t>(positions[i][axis] + 0.0)) * 0xff51afd7ed558ccdu;
      hash ^= hash >> 29;
    }
    first[i] = table.add(i, hash, [&](std::uint32_t a, std::uint32_t b) { return positions[a] == positions[b]; });
  }
  return first;
}

}  // namespace

namespace {

/// The median of a thousand edges, evenly spread over the triangles.
double typical_edge(const TriangleSet& triangles) {
  std::vector<double> lengths;
  const std::size_t step = std::max<std::size_t>(1, triangles.size() / 1000);
  for (std::size_t i = 0; i < triangles.size(); i += step) {
    const auto& [a, b, c] = triangles.corners[i];
    lengths.push_back(math::length(triangles.positions[b] - triangles.positions[a]));
  }
  if (lengths.empty()) return HUGE_VAL;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

}  // namespace

void link_neighbours(TriangleSet& triangles, std::span<const std::uint32_t> groups) {
  constexpr std::uint32_t none = TriangleSet::no_neighbour;
  const std::vector<std::uint32_t> place = welded(triangles.positions);
  triangles.neighbours.assign(triangles.size(), {none, none, none});
  triangles.typical_edge = typical_edge(triangles);
  // A half-edge is numbered 4 · triangle + edge.
  const auto from = [&](std::uint32_t half) { return place[triangles.corners[half / 4][half % 4]]; };
  const auto to = [&](std::uint32_t half) { return place[triangles.corners[half / 4][(half % 4 + 1) % 3]]; };
  IndexTable edges(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (groups[t] == no_group) continue;
    for (std::uint32_t e = 0; e < 3; ++e) {
      const std::uint32_t half = 4 * t + e;
      const std::uint64_t low = std::min(from(half), to(half)), high = std::max(from(half), to(half));
      const std::uint32_t other =
          edges.add(half, (low << 32 | high) ^ groups[t], [&](std::uint32_t a, std::uint32_t b) {
            // What has found its neighbour takes no other, so that three triangles at an edge stay a pair and a single.
            return from(a) == to(b) && to(a) == from(b) && groups[a / 4] == groups[b / 4] &&
                   triangles.neighbours[a / 4][a % 4] == none && a / 4 != b / 4;
          });
      if (other == half) continue;
      triangles.neighbours[t][e] = other / 4;
      triangles.neighbours[other / 4][other % 4] = t;
    }
  }
}

}  // namespace penumbra::accel
