// What crosses a region: everything that does, nothing that clearly does not, and no more once it was told to stop.
#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <set>

#include "engine/accel/neighbours.h"
#include "engine/accel/normal_cones.h"
#include "engine/accel/structure_search.h"
#include "tests/robustness/worlds.h"

using namespace penumbra;
using accel::HalfSpaces;
using math::Vec3;

namespace {

struct Pyramid {
  Vec3 apex;
  std::array<Vec3, 4> corners;
  HalfSpaces region;

  explicit Pyramid(test::Random& random)
      : apex(random.in_cube(4)), corners(square(random)), region(accel::pyramid(apex, corners, false)) {}
  static std::array<Vec3, 4> square(test::Random& random) {
    const Vec3 middle = random.in_cube(4);
    const math::Frame frame = math::frame_around(random.direction());
    const Vec3 u = frame.u * random.between(0.1, 2), v = frame.v * random.between(0.1, 2);
    return {middle - u - v, middle + u - v, middle + u + v, middle - u + v};
  }
  Vec3 point(test::Random& random) const {
    const double s = random.between(0, 1), t = random.between(0, 1);
    const Vec3 end = (corners[0] * (1 - s) + corners[1] * s) * (1 - t) + (corners[3] * (1 - s) + corners[2] * s) * t;
    return apex + (end - apex) * random.between(0, 1);
  }
  /// Beyond one side or the base, as far as `margin` at least.
  bool is_clearly_outside(const std::vector<Vec3>& points, double margin) const {
    const Vec3 middle = (corners[0] + corners[2]) * 0.5;
    const auto all_beyond = [&](Vec3 outward, const Vec3& at, const Vec3& inner) {
      outward = math::normalize(outward);
      if (math::dot(outward, inner - at) > 0) outward = -outward;
      return std::ranges::all_of(points, [&](const Vec3& p) { return math::dot(outward, p - at) > margin; });
    };
    for (std::size_t i = 0; i < 4; ++i) {
      if (all_beyond(math::cross(corners[i] - apex, corners[(i + 1) % 4] - apex), apex, middle)) return true;
    }
    return all_beyond(math::cross(corners[1] - corners[0], corners[3] - corners[0]), middle, apex);
  }
};

/// Triangles, spheres and boxes around a pyramid, some through points of it.
struct Things {
  accel::TriangleSet triangles;
  std::vector<geometry::SphereShape> spheres;
  std::vector<accel::OtherEntry> others;
  std::set<std::uint32_t> met_triangles, met_others;

  Things(test::Random& random, const Pyramid& pyramid, int count) {
    spheres.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
      const bool is_met = random.below(4) == 0;
      const Vec3 at = is_met ? pyramid.point(random) : random.in_cube(8);
      const Vec3 a = random.in_cube(0.5), b = random.in_cube(0.5);
      const auto first = static_cast<std::uint32_t>(triangles.positions.size());
      triangles.positions.insert(triangles.positions.end(), {at + a, at + b, at - a - b});
      if (is_met) met_triangles.insert(static_cast<std::uint32_t>(triangles.size()));
      triangles.corners.push_back({first, first + 1, first + 2});
    }
    for (int i = 0; i < count / 2; ++i) {
      const bool is_met = random.below(4) == 0;
      const double size = random.between(0.01, 0.5);
      const Vec3 at = (is_met ? pyramid.point(random) : random.in_cube(8)) + random.direction() * (0.99 * size);
      const auto item = static_cast<std::uint32_t>(1000 + i);
      math::Bounds box;
      box.include(at - Vec3{size, size, size}), box.include(at + Vec3{size, size, size});
      if (is_met) met_others.insert(item);
      const bool is_sphere = random.below(2) == 0;
      if (is_sphere) spheres.push_back({at, size});
      others.push_back({box, item, is_sphere ? &spheres.back() : nullptr});
    }
  }
  accel::Structure wide() const {
    return {nullptr, std::make_shared<accel::WideTree>(triangles, others, accel::run_in_turn), nullptr};
  }
  accel::Structure plain() const {
    std::vector<accel::TreeEntry> entries;
    for (std::uint32_t i = 0; i < triangles.size(); ++i) entries.push_back({triangles.bounds_of(i), i, true});
    for (const accel::OtherEntry& other : others) entries.push_back({other.box, other.item, false});
    return {std::make_shared<accel::Tree>(scene::Acceleration::median, entries), nullptr, nullptr};
  }
  std::vector<Vec3> corners(std::uint32_t triangle) const {
    const geometry::TriangleVertices t = triangles[triangle];
    return {t.v0, t.v1, t.v2};
  }
};

}  // namespace

TEST_CASE("a search of a region finds all that meets it, once, and no triangle that is clearly beside it") {
  test::Random random(31);
  std::size_t beside = 0;
  for (int round = 0; round < 150; ++round) {
    const Pyramid pyramid(random);
    const Things things(random, pyramid, 1 + random.below(120));
    for (const accel::Structure& structure : {things.wide(), things.plain()}) {
      std::map<std::uint32_t, int> triangles, others;
      const auto at_triangle = [&](std::uint32_t triangle, const accel::RegionVisitor::EdgeFlags& edges) {
        ++triangles[triangle];
        for (std::size_t e = 0; e < 3; ++e) CHECK(edges[e]);
        return false;
      };
      const auto at_other = [&](std::uint32_t item) {
        ++others[item];
        return false;
      };
      CHECK_FALSE(accel::search(structure, pyramid.region, nullptr, at_triangle, at_other, [] { CHECK(false); }));
      for (const std::uint32_t met : things.met_triangles) CHECK(triangles[met] == 1);
      for (const std::uint32_t met : things.met_others) CHECK(others[met] == 1);
      for (const auto& [triangle, times] : triangles) CHECK(times <= 1);
      for (const auto& [item, times] : others) CHECK(times <= 1);
      if (!structure.wide) continue;
      for (std::uint32_t t = 0; t < things.triangles.size(); ++t) {
        if (!pyramid.is_clearly_outside(things.corners(t), 1e-3)) continue;
        ++beside;
        CHECK_FALSE(triangles.contains(t));
      }
    }
  }
  CHECK(beside > 1000);
}

TEST_CASE("a search ends when it is told to") {
  test::Random random(32);
  for (int round = 0; round < 100; ++round) {
    const Pyramid pyramid(random);
    const Things things(random, pyramid, 1 + random.below(60));
    for (const accel::Structure& structure : {things.wide(), things.plain()}) {
      int calls = 0, last = 0;
      const auto at_triangle = [&](std::uint32_t, const accel::RegionVisitor::EdgeFlags&) { return ++calls == last; };
      const auto at_other = [&](std::uint32_t) { return ++calls == last; };
      const auto find = [&] { return accel::search(structure, pyramid.region, nullptr, at_triangle, at_other, [] {}); };
      CHECK_FALSE(find());
      const int all = calls;
      for (last = 1; last <= all; ++last) {
        calls = 0;
        CHECK(find());
        CHECK(calls == last);
      }
    }
  }
}

namespace {

/// A ball of triangles, with neighbours but along a seam.
accel::TriangleSet ball(test::Random& random, const Vec3& center, double radius) {
  accel::TriangleSet ball;
  constexpr std::uint32_t rows = 12, columns = 16;
  for (std::uint32_t row = 0; row <= rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      const double a = 3.14159 * row / rows, b = 2 * 3.14159 * column / columns;
      const Vec3 out{std::sin(a) * std::cos(b), std::cos(a), std::sin(a) * std::sin(b)};
      ball.positions.push_back(center + (out + random.in_cube(0.02)) * radius);
    }
  }
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      const std::uint32_t right = (column + 1) % columns, a = row * columns + column, b = row * columns + right;
      ball.corners.push_back({a, b, b + columns}), ball.corners.push_back({a, b + columns, a + columns});
    }
  }
  accel::link_neighbours(ball, std::vector<std::uint32_t>(ball.size(), 0));
  return ball;
}

double side(const geometry::TriangleVertices& t, const Vec3& from) {
  return math::dot(math::cross(t.v1 - t.v0, t.v2 - t.v0), from - t.v0);
}

}  // namespace

TEST_CASE("what a search leaves out has no silhouette edge, seen from anywhere in the ball of viewpoints") {
  test::Random random(33);
  std::size_t left_out = 0, plain = 0, silhouettes = 0, within = 0;
  for (int round = 0; round < 100; ++round) {
    const Vec3 center = random.in_cube(2);
    const accel::TriangleSet triangles = ball(random, center, random.between(0.5, 1));
    const auto tree =
        std::make_shared<accel::WideTree>(triangles, std::span<const accel::OtherEntry>{}, accel::run_in_turn);
    const accel::Structure structure{nullptr, tree,
                                     std::make_shared<accel::NormalCones>(*tree, triangles, accel::run_in_turn)};
    // Everything is in the region, and all but a few triangles within its limit.
    const Vec3 viewpoint = center + random.direction() * random.between(2, 5);
    HalfSpaces region(viewpoint, 20, {{-20, -20, -20}, {20, 20, 20}});
    const Vec3 way = math::normalize(center - viewpoint);
    const double limit = math::dot(way, center - viewpoint) + random.between(-0.5, 2);
    region.add_limit(way, limit);
    const auto reaches = [&](std::uint32_t triangle) {
      const geometry::TriangleVertices t = triangles[triangle];
      return std::max(
          {math::dot(way, t.v0 - viewpoint), math::dot(way, t.v1 - viewpoint), math::dot(way, t.v2 - viewpoint)});
    };
    const double radius = random.between(0, 0.2);
    std::map<std::uint32_t, accel::RegionVisitor::EdgeFlags> found;
    bool is_told = false;
    const accel::Silhouettes seen{*structure.cones, viewpoint, radius};
    const auto at_triangle = [&](std::uint32_t triangle, const accel::RegionVisitor::EdgeFlags& edges) {
      found.emplace(triangle, edges);
      if (edges.is_within_limits) CHECK(reaches(triangle) < limit);
      if (reaches(triangle) < limit - 1e-3) CHECK(edges.is_within_limits);
      within += edges.is_within_limits ? 1 : 0;
      return false;
    };
    accel::search(
        structure, region, &seen, at_triangle, [](std::uint32_t) { return false; }, [&] { is_told = true; });
    CHECK(is_told == (found.size() < triangles.size()));
    left_out += triangles.size() - found.size();
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      if (reaches(t) >= limit) CHECK(found.contains(t));
      for (std::size_t e = 0; e < 3; ++e) {
        const std::uint32_t other = triangles.neighbours[t][e];
        bool is_silhouette = other == accel::TriangleSet::no_neighbour;
        for (int k = 0; k < 8 && !is_silhouette; ++k) {
          const Vec3 from = viewpoint + random.direction() * (radius * (k < 4 ? 1 : random.between(0, 1)));
          is_silhouette = (side(triangles[t], from) > 0) != (side(triangles[other], from) > 0);
        }
        const bool is_shown = found.contains(t) && found.at(t)[e];
        if (is_silhouette) CHECK(is_shown);
        silhouettes += is_silhouette ? 1 : 0, plain += is_shown ? 0 : 1;
      }
    }
  }
  CHECK(silhouettes > 1000);
  CHECK(within > 1000);
  CHECK(left_out > 10'000);
  CHECK(plain > 60'000);
}

namespace {

/// Adds a square sheet of small hills.
void add_sheet(test::Random& random, const Vec3& at, double scale, double height, accel::TriangleSet& sheet) {
  constexpr std::uint32_t size = 16;
  const auto first = static_cast<std::uint32_t>(sheet.positions.size());
  for (std::uint32_t x = 0; x <= size; ++x) {
    for (std::uint32_t y = 0; y <= size; ++y) {
      const Vec3 place{static_cast<double>(x), random.between(0, height), static_cast<double>(y)};
      sheet.positions.push_back(at + place * scale);
    }
  }
  for (std::uint32_t x = 0; x < size; ++x) {
    for (std::uint32_t y = 0; y < size; ++y) {
      const std::uint32_t a = first + x * (size + 1) + y, b = a + size + 1;
      sheet.corners.push_back({a, a + 1, b}), sheet.corners.push_back({b, a + 1, b + 1});
    }
  }
}

accel::Structure with_cones(const accel::TriangleSet& triangles) {
  const auto tree =
      std::make_shared<accel::WideTree>(triangles, std::span<const accel::OtherEntry>{}, accel::run_in_turn);
  return {nullptr, tree, std::make_shared<accel::NormalCones>(*tree, triangles, accel::run_in_turn)};
}

}  // namespace

TEST_CASE("a search that leaves out all triangles tells that there are some") {
  test::Random random(35);
  accel::TriangleSet sheet;
  add_sheet(random, {}, 1, 0.05, sheet);
  accel::link_neighbours(sheet, std::vector<std::uint32_t>(sheet.size(), 0));
  const accel::Structure structure = with_cones(sheet);
  const Vec3 above{8, 50, 8}, down{0, -1, 0};
  HalfSpaces region(above, 100, {{6, -1, 6}, {10, 1, 10}});
  region.add_limit(down, 60);
  const accel::Silhouettes seen{*structure.cones, above, 0};
  int found = 0, told = 0;
  const auto at_triangle = [&](std::uint32_t, const accel::RegionVisitor::EdgeFlags&) { return ++found < 0; };
  accel::search(
      structure, region, &seen, at_triangle, [](std::uint32_t) { return false; }, [&] { ++told; });
  CHECK(found == 0);
  CHECK(told == 1);
}

TEST_CASE("no silhouette of small triangles seen all but edge-on is lost to single precision") {
  test::Random random(34);
  accel::TriangleSet sheet;
  // Three pieces, apart from each other by far more than a triangle is wide: so much of its place is rounded.
  for (const Vec3& piece : {Vec3{}, Vec3{1.3, -0.7, 0.9}, Vec3{-1.1, 0.9, 0.3}})
    add_sheet(random, piece, 0.001, 2, sheet);
  accel::link_neighbours(sheet, std::vector<std::uint32_t>(sheet.size(), 0));
  const accel::Structure structure = with_cones(sheet);
  int silhouettes = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto t = static_cast<std::uint32_t>(random.below(static_cast<int>(sheet.size())));
    const geometry::TriangleVertices at = sheet[t];
    const Vec3 normal = math::normalize(math::cross(at.v1 - at.v0, at.v2 - at.v0));
    const Vec3 along = math::normalize(math::cross(normal, random.direction()));
    const Vec3 from =
        at.v0 + along * random.between(0.1, 3) + normal * std::ldexp(random.between(-1, 1), -random.below(30));
    HalfSpaces region(from, 9, {{-9, -9, -9}, {9, 9, 9}});
    region.add_limit(along, 9);
    const accel::Silhouettes seen{*structure.cones, from, 0};
    accel::RegionVisitor::EdgeFlags shown{{}, false};
    const auto at_triangle = [&](std::uint32_t triangle, const accel::RegionVisitor::EdgeFlags& edges) {
      if (triangle == t) shown = edges;
      return false;
    };
    accel::search(
        structure, region, &seen, at_triangle, [](std::uint32_t) { return false; }, [] {});
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t other = sheet.neighbours[t][e];
      const bool is_silhouette =
          other == accel::TriangleSet::no_neighbour || (side(at, from) > 0) != (side(sheet[other], from) > 0);
      if (is_silhouette) CHECK(shown[e]);
      silhouettes += is_silhouette ? 1 : 0;
    }
  }
  CHECK(silhouettes > 1000);
}
