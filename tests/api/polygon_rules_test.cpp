// Which polygons are refused, and that none is for vertices in the middle of its edges.
#include "api/polygon_rules.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

using namespace penumbra;
using math::Vec3;

namespace {

using Corners = std::vector<std::pair<double, double>>;

/// In small integers, of sizes that are powers of two: nothing is rounded.
const std::vector<Corners> convex{{{0, 0}, {8, 0}, {0, 8}},
                                  {{0, 0}, {8, 0}, {8, 4}, {0, 4}},
                                  {{4, 0}, {8, 4}, {4, 8}, {0, 4}},
                                  {{0, 0}, {4, 0}, {8, 4}, {4, 4}},
                                  {{0, 2}, {4, 0}, {8, 6}, {2, 8}},
                                  {{8, 8}, {0, 6}, {4, 2}},
                                  {{-4, -8}, {4, -6}, {2, 0}, {-2, 0}}};

std::vector<Vec3> in_space(const Corners& corners, int up, bool is_turned) {
  std::vector<Vec3> vertices;
  for (const auto& [x, y] : corners) {
    Vec3 v{16, 16, 16};
    v[(up + 1) % 3] += x, v[(up + 2) % 3] += y;
    vertices.push_back(v);
  }
  if (is_turned) std::ranges::reverse(vertices);
  return vertices;
}

std::vector<std::vector<Vec3>> every_way(const Corners& corners) {
  std::vector<std::vector<Vec3>> ways;
  for (int up = 0; up < 3; ++up) {
    for (const bool is_turned : {false, true}) ways.push_back(in_space(corners, up, is_turned));
  }
  return ways;
}

}  // namespace

TEST_CASE("a vertex in the middle of an edge is no fault, wherever the edge leads") {
  for (const Corners& corners : convex) {
    Corners more;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto [x, y] = corners[i];
      const auto [next_x, next_y] = corners[(i + 1) % corners.size()];
      more.emplace_back(x, y), more.emplace_back((x + next_x) / 2, (y + next_y) / 2);
    }
    for (const std::vector<Vec3>& vertices : every_way(corners)) CHECK_FALSE(api::polygon_fault(vertices));
    for (const std::vector<Vec3>& vertices : every_way(more)) CHECK_FALSE(api::polygon_fault(vertices));
  }
}

TEST_CASE("an edge that runs back, meets another or is no length is a fault, wherever it is") {
  for (const Corners& corners : convex) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto [x, y] = corners[i];
      const auto [next_x, next_y] = corners[(i + 1) % corners.size()];
      const auto with = [&](double share) {
        Corners spiked = corners;
        spiked.insert(spiked.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                      {x + (next_x - x) * share, y + (next_y - y) * share});
        return spiked;
      };
      // Beyond the edge's end and back; back before its start; its start again.
      for (const double share : {1.5, 2.0, -0.5, 0.0}) {
        for (const std::vector<Vec3>& vertices : every_way(with(share))) {
          INFO(x, " ", y, " ", next_x, " ", next_y, " share ", share);
          CHECK(api::polygon_fault(vertices));
        }
      }
    }
  }
  // Two squares that share a corner; a bow tie.
  for (const Corners& crossing : {Corners{{0, 0}, {4, 0}, {4, 4}, {8, 4}, {8, 8}, {4, 8}, {4, 4}, {0, 4}},
                                  Corners{{0, 0}, {8, 4}, {8, 0}, {0, 8}}}) {
    for (const std::vector<Vec3>& vertices : every_way(crossing)) CHECK(api::polygon_fault(vertices));
  }
}
