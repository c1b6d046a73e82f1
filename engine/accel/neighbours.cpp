#include "engine/accel/neighbours.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <deque>
#include <numeric>
#include <random>
#include <vector>

namespace penumbra::accel {
namespace {

/// For each vertex the first one at the same place: open addressing over their numbers.
std::vector<std::uint32_t> welded(const std::vector<math::Vec3>& positions) {
  // Not known beforehand, so that no scene can make all its vertices collide.
  static const std::uint64_t seed = std::uint64_t{std::random_device{}()} << 32 | std::random_device{}();
  constexpr std::uint32_t none = 0xffffffff;
  std::vector<std::uint32_t> table(std::bit_ceil(2 * positions.size() + 2), none);
  std::vector<std::uint32_t> first(positions.size());
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    std::uint64_t hash = seed;
    for (int axis = 0; axis < 3; ++axis) {
      // −0 is at the place of 0.
      hash = (hash ^ std::bit_cast<std::uint64_t>(positions[i][axis] + 0.0)) * 0xff51afd7ed558ccdu;
      hash ^= hash >> 29;
    }
    std::size_t slot = hash & (table.size() - 1);
    while (table[slot] != none && positions[table[slot]] != positions[i]) slot = (slot + 1) & (table.size() - 1);
    if (table[slot] == none) table[slot] = i;
    first[i] = table[slot];
  }
  return first;
}

/// One direction along an edge of a triangle, at the lower of its two vertices.
struct HalfEdge {
  std::uint32_t upper_and_direction, number;  // 2 · upper vertex + whether it comes from there; 4 · triangle + edge
  static HalfEdge of(std::uint32_t from, std::uint32_t to, std::uint32_t number) {
    return {from > to ? 2 * from + 1 : 2 * to, number};
  }
  std::uint32_t upper() const { return upper_and_direction / 2; }
  std::size_t direction() const { return upper_and_direction % 2; }
  std::uint32_t triangle() const { return number / 4; }
  std::uint32_t edge() const { return number % 4; }
};

/// Makes neighbours along one edge: each half-edge, in turn, takes the first of the other direction that is still
/// alone, so that three triangles at an edge stay a pair and a single.
class Pairing {
 public:
  explicit Pairing(TriangleSet& triangles) : triangles_(triangles) {}

  /// Of an edge from a vertex to itself both directions are the same.
  void pair(std::span<const HalfEdge> edge, bool is_loop) {
    for (std::deque<HalfEdge>& alone : alone_) alone.clear();
    for (const HalfEdge& half : edge) {
      std::deque<HalfEdge>& others = alone_[is_loop ? half.direction() : 1 - half.direction()];
      // A triangle is no neighbour of its own: of three edges it skips at most two.
      const auto other = std::ranges::find_if(
          others, [&](const HalfEdge& candidate) { return candidate.triangle() != half.triangle(); });
      if (other == others.end()) {
        alone_[half.direction()].push_back(half);
        continue;
      }
      triangles_.neighbours[half.triangle()][half.edge()] = other->triangle();
      triangles_.neighbours[other->triangle()][other->edge()] = half.triangle();
      others.erase(other);
    }
  }

 private:
  TriangleSet& triangles_;
  std::array<std::deque<HalfEdge>, 2> alone_;  // by direction
};

}  // namespace

void link_neighbours(TriangleSet& triangles, std::span<const std::uint32_t> groups) {
  constexpr std::uint32_t none = TriangleSet::no_neighbour;
  triangles.neighbours.assign(triangles.size(), {none, none, none});
  const std::vector<std::uint32_t> place = welded(triangles.positions);
  const auto for_each_half_edge = [&](const auto& use) {
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      if (groups[t] == no_group) continue;
      const auto& [a, b, c] = triangles.corners[t];
      const std::uint32_t v[4]{place[a], place[b], place[c], place[a]};
      for (std::uint32_t e = 0; e < 3; ++e) use(HalfEdge::of(v[e], v[e + 1], 4 * t + e), std::min(v[e], v[e + 1]));
    }
  };
  // By the lower of its two vertices: a counting sort.
  std::vector<std::uint32_t> end(place.size() + 1);
  for_each_half_edge([&](const HalfEdge&, std::uint32_t lower) { ++end[lower + 1]; });
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<HalfEdge> half_edges(end.back());
  for_each_half_edge([&](const HalfEdge& half, std::uint32_t lower) { half_edges[end[lower]++] = half; });
  Pairing pairing(triangles);
  std::size_t begin = 0;
  for (std::uint32_t lower = 0; lower < place.size(); ++lower) {
    const std::span at_vertex(half_edges.data() + begin, half_edges.data() + end[lower]);
    begin = end[lower];
    std::sort(at_vertex.begin(), at_vertex.end(), [&](const HalfEdge& a, const HalfEdge& b) {
      if (a.upper() != b.upper()) return a.upper() < b.upper();
      const std::uint32_t group = groups[a.triangle()], other_group = groups[b.triangle()];
      return group != other_group ? group < other_group : a.number < b.number;
    });
    for (std::size_t i = 0; i < at_vertex.size();) {
      std::size_t j = i + 1;
      while (j < at_vertex.size() && at_vertex[j].upper() == at_vertex[i].upper() &&
             groups[at_vertex[j].triangle()] == groups[at_vertex[i].triangle()])
        ++j;
      if (j > i + 1) pairing.pair(at_vertex.subspan(i, j - i), at_vertex[i].upper() == lower);
      i = j;
    }
  }
}

}  // namespace penumbra::accel
