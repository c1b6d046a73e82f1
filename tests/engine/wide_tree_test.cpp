#include "engine/accel/wide_tree.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/accel/neighbours.h"
#include "engine/accel/normal_cones.h"
#include "tests/robustness/worlds.h"

using namespace penumbra;
using accel::WideTree;
using math::Vec3;

namespace {

/// Triangles, spheres and boxes, here and there in heaps.
struct Things {
  accel::TriangleSet triangles;
  std::vector<geometry::SphereShape> spheres;
  std::vector<accel::OtherEntry> others;

  Things(test::Random& random, int count, bool are_heaped) {
    spheres.reserve(static_cast<std::size_t>(count));
    Vec3 at;
    for (int i = 0; i < count; ++i) {
      if (!are_heaped || random.below(20) == 0) at = random.in_cube(100);
      const int kind = random.below(8);
      const double size = random.between(0, 1);
      if (kind < 4) {
        const auto first = static_cast<std::uint32_t>(triangles.positions.size());
        for (int k = 0; k < 3; ++k) triangles.positions.push_back(at + (are_heaped ? Vec3{} : random.in_cube(size)));
        triangles.corners.push_back({first, first + 1, first + 2});
        continue;
      }
      const Vec3 half{size, size, size};
      const auto item = static_cast<std::uint32_t>(others.size());
      const bool is_sphere = kind < 7;
      if (is_sphere) spheres.push_back({at, size});
      others.push_back({{at - half, at + half}, item, is_sphere ? &spheres.back() : nullptr});
    }
  }
};

/// What a walk through all of a tree meets, and whether boxes around it hold it.
struct Contents {
  const WideTree& tree;
  const Things& things;
  std::vector<std::uint32_t> triangles, items;
  bool are_held = true;

  void at(std::uint32_t reference, const math::Bounds& box) {
    const std::uint32_t index = WideTree::index_of(reference);
    switch (WideTree::sort_of(reference)) {
      case WideTree::Sort::node: {
        const WideTree::Node& node = tree.nodes()[index];
        for (std::size_t lane = 0; lane < WideTree::width; ++lane) {
          const math::Bounds child{{node.bounds[0][lane], node.bounds[1][lane], node.bounds[2][lane]},
                                   {node.bounds[3][lane], node.bounds[4][lane], node.bounds[5][lane]}};
          at(node.child[lane], child);
        }
        return;
      }
      case WideTree::Sort::triangle_block:
        return at_triangles(tree.triangle_blocks()[index], box);
      case WideTree::Sort::sphere_block:
        return at_spheres(tree.sphere_blocks()[index], box);
      case WideTree::Sort::leaf: {
        const WideTree::Leaf& leaf = tree.leaves()[index];
        for (auto i = leaf.triangle_begin; i < leaf.triangle_end; ++i) at_triangles(tree.triangle_blocks()[i], box);
        for (auto i = leaf.sphere_begin; i < leaf.sphere_end; ++i) at_spheres(tree.sphere_blocks()[i], box);
        for (auto i = leaf.other_begin; i < leaf.other_end; ++i) at_item(tree.others()[i], box);
      }
    }
  }
  void at_triangles(const WideTree::TriangleBlock& block, const math::Bounds& box) {
    for (std::size_t lane = 0; lane < WideTree::width; ++lane) {
      if (std::isnan(block.vertex[0][0][lane])) continue;
      triangles.push_back(block.triangle[lane]);
      hold(things.triangles.bounds_of(block.triangle[lane]), box);
    }
  }
  void at_spheres(const WideTree::SphereBlock& block, const math::Bounds& box) {
    for (std::size_t lane = 0; lane < WideTree::width; ++lane) {
      if (!std::isnan(block.radius[lane])) at_item(block.item[lane], box);
    }
  }
  void at_item(std::uint32_t item, const math::Bounds& box) {
    items.push_back(item);
    hold(things.others[item].box, box);
  }
  void hold(const math::Bounds& given, const math::Bounds& box) {
    for (int axis = 0; axis < 3; ++axis) {
      are_held = are_held && box.lower[axis] <= given.lower[axis] - tree.origin()[axis] &&
                 given.upper[axis] - tree.origin()[axis] <= box.upper[axis];
    }
  }
};

template <class Value>
bool same_bytes(const std::vector<Value>& a, const std::vector<Value>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0);
}

void run_backwards(std::int64_t count, const std::function<void(std::int64_t)>& task) {
  for (std::int64_t i = count; i > 0; --i) task(i - 1);
}

}  // namespace

TEST_CASE("a wide tree holds every entry once, in boxes around it, and is the same whoever builds its parts first") {
  test::Random random(72);
  const math::Bounds everywhere{{-math::infinity, -math::infinity, -math::infinity},
                                {math::infinity, math::infinity, math::infinity}};
  for (const int count : {0, 1, 2, 7, 8, 9, 64, 65, 1000, 1024, 40'000}) {
    for (const bool are_heaped : {false, true}) {
      const Things things(random, count, are_heaped);
      const WideTree tree(things.triangles, things.others, accel::run_in_turn);
      Contents contents{tree, things, {}, {}};
      contents.at(tree.root(), everywhere);
      std::ranges::sort(contents.triangles), std::ranges::sort(contents.items);
      CHECK(contents.are_held);
      CHECK(contents.triangles.size() == things.triangles.size());
      CHECK(contents.items.size() == things.others.size());
      bool are_all = true;
      for (std::uint32_t i = 0; i < contents.triangles.size(); ++i) are_all = are_all && contents.triangles[i] == i;
      for (std::uint32_t i = 0; i < contents.items.size(); ++i) are_all = are_all && contents.items[i] == i;
      CHECK(are_all);
      const WideTree again(things.triangles, things.others, run_backwards);
      CHECK(again.root() == tree.root());
      CHECK(same_bytes(again.nodes(), tree.nodes()));
      CHECK(same_bytes(again.leaves(), tree.leaves()));
      CHECK(same_bytes(again.triangle_blocks(), tree.triangle_blocks()));
      CHECK(same_bytes(again.sphere_blocks(), tree.sphere_blocks()));
      CHECK(same_bytes(again.others(), tree.others()));
    }
  }
}

namespace {

/// A sheet of hills: steep ones here, shallow ones there.
accel::TriangleSet sheet(test::Random& random) {
  accel::TriangleSet sheet;
  constexpr std::uint32_t size = 40;
  for (std::uint32_t x = 0; x <= size; ++x) {
    for (std::uint32_t y = 0; y <= size; ++y)
      sheet.positions.push_back({static_cast<double>(x), random.between(0, 0.05 * x), static_cast<double>(y)});
  }
  for (std::uint32_t x = 0; x < size; ++x) {
    for (std::uint32_t y = 0; y < size; ++y) {
      const std::uint32_t a = x * (size + 1) + y, b = a + size + 1;
      sheet.corners.push_back({a, a + 1, b}), sheet.corners.push_back({b, a + 1, b + 1});
    }
  }
  accel::link_neighbours(sheet, std::vector<std::uint32_t>(sheet.size(), 0));
  return sheet;
}

Vec3 normal_of(const accel::TriangleSet& triangles, std::uint32_t index) {
  const geometry::TriangleVertices t = triangles[index];
  return math::normalize(math::cross(t.v1 - t.v0, t.v2 - t.v0));
}

/// The triangles below a reference.
void collect(const WideTree& tree, std::uint32_t reference, std::vector<std::uint32_t>& found) {
  const std::uint32_t index = WideTree::index_of(reference);
  const auto add = [&](const WideTree::TriangleBlock& block) {
    for (std::size_t lane = 0; lane < WideTree::width; ++lane) {
      if (!std::isnan(block.vertex[0][0][lane])) found.push_back(block.triangle[lane]);
    }
  };
  if (WideTree::sort_of(reference) == WideTree::Sort::triangle_block) add(tree.triangle_blocks()[index]);
  if (WideTree::sort_of(reference) == WideTree::Sort::leaf) {
    const WideTree::Leaf& leaf = tree.leaves()[index];
    for (auto i = leaf.triangle_begin; i < leaf.triangle_end; ++i) add(tree.triangle_blocks()[i]);
  }
  if (WideTree::sort_of(reference) != WideTree::Sort::node) return;
  for (const std::uint32_t child : tree.nodes()[index].child) collect(tree, child, found);
}

}  // namespace

TEST_CASE("a normal cone holds the normals below it and of their neighbours, and is told where these turn little") {
  test::Random random(73);
  const accel::TriangleSet triangles = sheet(random);
  const WideTree tree(triangles, {}, accel::run_in_turn);
  const accel::NormalCones cones(tree, triangles, accel::run_in_turn);
  int told = 0, narrow = 0;
  for (std::uint32_t n = 0; n < tree.nodes().size(); ++n) {
    for (std::size_t lane = 0; lane < WideTree::width; ++lane) {
      const accel::NormalCones::Cones& cone = cones.of_node(n);
      std::vector<std::uint32_t> below;
      collect(tree, tree.nodes()[n].child[lane], below);
      const Vec3 axis{cone.axis[0][lane], cone.axis[1][lane], cone.axis[2][lane]};
      bool has_all_neighbours = !below.empty();
      double cosine = 1, mean_cosine = 1;
      Vec3 sum;
      std::vector<Vec3> normals;
      for (const std::uint32_t t : below) {
        normals.push_back(normal_of(triangles, t));
        for (const std::uint32_t other : triangles.neighbours[t]) {
          has_all_neighbours = has_all_neighbours && other != accel::TriangleSet::no_neighbour;
          if (other != accel::TriangleSet::no_neighbour) normals.push_back(normal_of(triangles, other));
        }
      }
      for (const Vec3& normal : normals) sum += normal;
      for (const Vec3& normal : normals) {
        cosine = std::min(cosine, math::dot(axis, normal));
        mean_cosine = std::min(mean_cosine, math::dot(math::normalize(sum), normal));
      }
      const bool is_told = !std::isnan(cone.cosine[lane]);
      if (!has_all_neighbours) CHECK_FALSE(is_told);
      told += is_told ? 1 : 0;
      if (is_told) {
        CHECK(cosine >= cone.cosine[lane]);
        CHECK(cone.sine[lane] >= std::sqrt(1 - cosine * cosine) - 1e-6);
      }
      // A cone of a third of a radian around the mean is far from the widest that is told.
      if (!has_all_neighbours || mean_cosine < 0.95) continue;
      ++narrow;
      CHECK(is_told);
      CHECK(cone.cosine[lane] > 0.7);
    }
  }
  CHECK(told > 50);
  CHECK(narrow > 20);
}

TEST_CASE("a tree of triangles that nothing tells apart is no deeper than halves make it") {
  accel::TriangleSet triangles;
  triangles.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangles.corners.assign(4000, {0, 1, 2});
  const WideTree tree(triangles, {}, accel::run_in_turn);
  const auto depth = [&](const auto& self, std::uint32_t reference) -> int {
    if (WideTree::sort_of(reference) != WideTree::Sort::node) return 0;
    int deepest = 0;
    for (const std::uint32_t child : tree.nodes()[WideTree::index_of(reference)].child)
      deepest = std::max(deepest, self(self, child));
    return deepest + 1;
  };
  // Nine halvings leave eight of 4000 at most.
  CHECK(depth(depth, tree.root()) <= 9);
  std::vector<std::uint32_t> found;
  collect(tree, tree.root(), found);
  CHECK(found.size() == 4000);
}

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
  const Vec3 middle{30, -20, 10};
  for (int i = 0; i < 5000; ++i) {
    const Vec3 at = middle + random.in_cube(1);
    add(at, at + random.in_cube(0.01), at + random.in_cube(0.01));
  }
  const accel::WideTree tree(triangles, {}, accel::run_in_turn);
  CHECK(math::max_component(math::abs(tree.origin() - middle)) < 0.2);
  CHECK(tree.reach() > 9e6);
}
