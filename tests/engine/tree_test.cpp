// The plain tree: every entry once, in boxes that hold it, and laid out as its header says.
#include "engine/accel/tree.h"

#include <doctest/doctest.h>

#include <algorithm>

#include "engine/accel/slab.h"
#include "tests/robustness/worlds.h"

using namespace penumbra;
using accel::Tree;
using math::Vec3;

namespace {

bool holds(const math::Bounds& outer, const math::Bounds& inner) {
  return math::min(outer.lower, inner.lower) == outer.lower && math::max(outer.upper, inner.upper) == outer.upper;
}

std::vector<accel::TreeEntry> random_entries(test::Random& random, std::uint32_t count) {
  std::vector<accel::TreeEntry> entries;
  for (std::uint32_t i = 0; i < count; ++i) {
    math::Bounds box;
    const Vec3 at = random.in_cube(5);
    box.include(at), box.include(at + random.in_cube(0.5));
    entries.push_back({box, 7 * i, random.below(2) == 0});
  }
  return entries;
}

struct Walked {
  std::vector<std::uint32_t> triangles, others;
  std::size_t largest_leaf = 0, depth = 0;
};

void walk(const Tree& tree, const Tree::Node& node, const std::vector<accel::TreeEntry>& entries, std::size_t depth,
          Walked& walked) {
  walked.depth = std::max(walked.depth, depth);
  if (!node.is_leaf()) {
    for (const Tree::Node& child : tree.children(node)) {
      CHECK(holds(node.box, child.box));
      walk(tree, child, entries, depth + 1, walked);
    }
    return;
  }
  walked.largest_leaf = std::max(walked.largest_leaf, tree.triangles(node).size() + tree.others(node).size());
  for (const std::uint32_t id : tree.triangles(node)) walked.triangles.push_back(id);
  for (const std::uint32_t id : tree.others(node)) walked.others.push_back(id);
  for (const auto& ids : {tree.triangles(node), tree.others(node)}) {
    for (const std::uint32_t id : ids) CHECK(holds(node.box, entries[id / 7].box));
  }
}

Walked walked_through(const Tree& tree, const std::vector<accel::TreeEntry>& entries) {
  Walked walked;
  walk(tree, tree.root(), entries, 0, walked);
  std::vector<std::uint32_t> triangles, others;
  for (const accel::TreeEntry& entry : entries) (entry.is_triangle ? triangles : others).push_back(entry.id);
  std::ranges::sort(walked.triangles), std::ranges::sort(walked.others);
  CHECK(walked.triangles == triangles);
  CHECK(walked.others == others);
  return walked;
}

}  // namespace

TEST_CASE("every acceleration's tree holds each entry once, in boxes around it") {
  test::Random random(3);
  for (const std::uint32_t count : {0u, 1u, 2u, 3u, 4u, 5u, 64u, 100u, 257u}) {
    const std::vector<accel::TreeEntry> entries = random_entries(random, count);
    const Walked none = walked_through(Tree(scene::Acceleration::none, entries), entries);
    CHECK(none.depth == 0);
    const Walked cbr = walked_through(Tree(scene::Acceleration::cbr, entries), entries);
    CHECK(cbr.depth == (count == 0 ? 0 : 1));
    CHECK(cbr.largest_leaf <= 1);
    const Walked median = walked_through(Tree(scene::Acceleration::median, entries), entries);
    CHECK(median.largest_leaf <= 2);
    // Halves, until there are at most two: no branch is longer than another by more than one.
    std::size_t depth = 0;
    for (std::size_t most = count; most > 2; most = (most + 1) / 2) ++depth;
    CHECK(median.depth == depth);
    accel::Grouping grouping;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (i % 3 == 0) grouping.entries.push_back(i);
      if (i % 3 == 1) grouping.groups.push_back({{i}, {}});
      if (i % 3 == 2) grouping.groups.back().groups.push_back({{i}, {}});
    }
    const Walked groups = walked_through(Tree(scene::Acceleration::groups, entries, grouping), entries);
    CHECK(groups.depth == std::min<std::size_t>(count, 3));
    CHECK(groups.largest_leaf <= 1);
  }
}

TEST_CASE("halves are divided at the median of their longest axis") {
  std::vector<accel::TreeEntry> entries;
  test::Random random(4);
  for (const int longest : {0, 1, 2}) {
    for (std::uint32_t i = 0; i < 50; ++i) {
      Vec3 at = random.in_cube(1);
      at[longest] *= 9;
      math::Bounds box;
      box.include(at);
      entries.push_back({box, 7 * i, true});
    }
    const Tree tree(scene::Acceleration::median, entries);
    const auto halves = tree.children(tree.root());
    REQUIRE(halves.size() == 2);
    CHECK(halves[0].box.upper[longest] <= halves[1].box.lower[longest]);
    entries.clear();
  }
}

TEST_CASE("a ray enters a box no later than it does, and misses those it clearly misses") {
  test::Random random(8);
  int hits = 0, misses = 0;
  for (int i = 0; i < 50'000; ++i) {
    math::Bounds box;
    const Vec3 at = random.in_cube(3);
    box.include(at), box.include(at + random.in_cube(2));
    const Vec3 origin = random.in_cube(6);
    Vec3 direction = i % 2 == 0 ? random.direction() : math::normalize(at + random.in_cube(1) - origin);
    if (i % 5 == 0) direction[random.below(3)] = 0;
    const double limit = random.below(2) == 0 ? math::infinity : random.between(0, 10);
    long double near = 0, far = limit;
    for (int axis = 0; axis < 3; ++axis) {
      const long double a = (static_cast<long double>(box.lower[axis]) - origin[axis]) / direction[axis],
                        b = (static_cast<long double>(box.upper[axis]) - origin[axis]) / direction[axis];
      near = std::max(near, std::min(a, b)), far = std::min(far, std::max(a, b));
    }
    const double entered = accel::enter(box, geometry::PreparedRay(origin, direction), limit);
    if (near <= far) {
      ++hits;
      CHECK(entered <= static_cast<double>(near));
      CHECK(entered >= static_cast<double>(near) - 1e-11);
    } else if (near > far + 1e-11L) {
      ++misses;
      CHECK(entered == math::infinity);
    }
  }
  CHECK(hits > 2000);
  CHECK(misses > 20'000);
}
