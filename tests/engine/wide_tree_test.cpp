#include "engine/accel/wide_tree.h"

#include <doctest/doctest.h>

#include "tests/robustness/worlds.h"

using namespace penumbra;
using math::Vec3;

TEST_CASE("single precision is finest where most entries are, however far a few reach") {
  test::Random random(71);
  accel::TriangleSet triangles;
  const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto first = static_cast<std::uint32_t>(triangles.positions.size());
    triangles.positions.insert(triangles.positions.end(), {a, b, c});
    triangles.corners.push_back({first, first + 1, first + 2});
  };
  add({-9, -1, -9}, {1e7, -1, -9}, {1e7, -1, 1e7});
  add({-9, -1, -9}, {1e7, -1, 1e7}, {-9, -1, 1e7});
  for (int i = 0; i < 5000; ++i) {
    const Vec3 at = random.in_cube(1);
    add(at, at + random.in_cube(0.01), at + random.in_cube(0.01));
  }
  const accel::WideTree tree(triangles, {}, accel::run_in_turn);
  CHECK(math::max_component(math::abs(tree.origin())) < 0.2);
  CHECK(tree.reach() > 9e6);
}
