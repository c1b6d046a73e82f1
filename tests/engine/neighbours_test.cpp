// Which triangle lies across an edge, whatever the triangles.
#include "engine/accel/neighbours.h"

#include <doctest/doctest.h>

#include <random>
#include <vector>

namespace penumbra::accel {
namespace {

using Neighbours = std::vector<std::array<std::uint32_t, 3>>;
constexpr std::uint32_t none = TriangleSet::no_neighbour;

/// Every half-edge in turn takes the first one the other way that is still alone.
Neighbours linked_by_search(const TriangleSet& triangles, const std::vector<std::uint32_t>& groups) {
  Neighbours neighbours(triangles.size(), {none, none, none});
  const auto vertex = [&](std::size_t t, std::size_t corner) {
    return triangles.positions[triangles.corners[t][corner % 3]];
  };
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t e = 0; e < 3; ++e) {
      for (std::size_t other = 0; other < t && neighbours[t][e] == none; ++other) {
        for (std::size_t f = 0; f < 3 && neighbours[t][e] == none; ++f) {
          if (groups[t] == no_group || groups[t] != groups[other] || neighbours[other][f] != none) continue;
          if (!(vertex(t, e) == vertex(other, f + 1) && vertex(t, e + 1) == vertex(other, f))) continue;
          neighbours[t][e] = static_cast<std::uint32_t>(other);
          neighbours[other][f] = static_cast<std::uint32_t>(t);
        }
      }
    }
  }
  return neighbours;
}

}  // namespace

TEST_CASE("neighbours of any triangles are those a search finds") {
  std::mt19937 generator(7);
  const auto random = [&](std::uint32_t below) { return static_cast<std::uint32_t>(generator() % below); };
  for (int round = 0; round < 200; ++round) {
    // A few places, some of them twice, so that edges have any number of triangles, and some triangles no area.
    const std::uint32_t count = 3 + random(9);
    TriangleSet triangles;
    for (std::uint32_t i = 0; i < count; ++i)
      triangles.positions.push_back({static_cast<double>(i / 2), i % 4 ? 0.0 : -0.0, 1});
    std::vector<std::uint32_t> groups;
    for (int i = 0; i < 60; ++i) {
      triangles.corners.push_back({random(count), random(count), random(count)});
      groups.push_back(random(8) == 0 ? no_group : random(2));
    }
    link_neighbours(triangles, groups);
    REQUIRE(triangles.neighbours == linked_by_search(triangles, groups));
  }
}

TEST_CASE("a million triangles at one edge take no longer than elsewhere") {
  // Would take an hour if each were compared with those before it.
  constexpr std::uint32_t count = 1'000'000;
  TriangleSet triangles;
  triangles.positions = {{0, 0, 0}, {0, 1, 0}};
  for (std::uint32_t i = 0; i < count; ++i) {
    triangles.positions.push_back({1, static_cast<double>(i), 1});
    const bool is_back = i >= count / 2;
    triangles.corners.push_back({is_back ? 1U : 0U, is_back ? 0U : 1U, i + 2});
  }
  link_neighbours(triangles, std::vector<std::uint32_t>(count));
  bool are_linked_in_order = true;
  for (std::uint32_t i = 0; i < count / 2; ++i) {
    are_linked_in_order = are_linked_in_order && triangles.neighbours[i][0] == i + count / 2 &&
                          triangles.neighbours[i + count / 2][0] == i;
  }
  CHECK(are_linked_in_order);
}

}  // namespace penumbra::accel
