#include <doctest/doctest.h>

#include <random>

#include "engine/geometry/polygon.h"
#include "engine/geometry/quadrics.h"
#include "engine/geometry/triangle.h"
#include "engine/math/constants.h"
#include "engine/math/elementary.h"

using namespace penumbra;
using math::Vec3;

namespace {

Vec3 area_vector(const Vec3& a, const Vec3& b, const Vec3& c) { return math::cross(b - a, c - a) * 0.5; }

}  // namespace

TEST_CASE("polygons split into triangles of the same winding that fill them exactly") {
  const std::vector<std::vector<Vec3>> polygons{
      {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}},                                                    // convex
      {{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {1.5, 1, 0}, {0, 3, 0}},                                       // concave
      {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 2, 0}, {0, 2, 0}},                              // collinear
      {{0, 0, 0}, {0, 3, 0}, {1.5, 1, 0}, {3, 3, 0}, {3, 0, 0}},                                       // clockwise
      {{0, 0, 0}, {4, 0, 1}, {4, 4, 1}, {0, 4, 0}, {0, 3, 0}, {3, 3, 0.75}, {3, 1, 0.75}, {0, 1, 0}},  // a C, tilted
  };
  for (const auto& polygon : polygons) {
    Vec3 whole;
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) whole += area_vector(polygon[0], polygon[i], polygon[i + 1]);
    Vec3 sum;
    double absolute = 0;
    for (const auto& [a, b, c] : geometry::triangulate(polygon)) {
      const Vec3 area = area_vector(polygon[a], polygon[b], polygon[c]);
      CHECK(math::dot(area, whole) > 0);
      sum += area;
      absolute += math::length(area);
    }
    CHECK(math::length(sum - whole) < 1e-12);
    CHECK(absolute == doctest::Approx(math::length(whole)));
  }
}

TEST_CASE("stars, combs, spirals and a corner that touches an edge are filled") {
  std::vector<std::vector<Vec3>> polygons;
  for (const int points : {5, 40, 500}) {
    std::vector<Vec3> star, comb, spiral;
    for (int i = 0; i < 2 * points; ++i) {
      const auto [sine, cosine] = math::sine_cosine_turns(i / (2.0 * points));
      star.push_back(Vec3{cosine, sine, 0} * (i % 2 == 0 ? 1.0 : 0.3));
      comb.push_back({0.5 * i, i % 2 == 0 ? 0.0 : 1.0 - 1e-3 * i / points, 0});
      const auto [s, c] = math::sine_cosine_turns((i < points ? i : 2 * points - 1 - i) * 3.0 / points);
      spiral.push_back(Vec3{c, s, 0} * (1 + (i < points ? i : 2 * points - 1 - i) + (i < points ? 0.0 : 0.5)));
    }
    comb.push_back({1.0 * points, -1, 0}), comb.push_back({-1, -1, 0});
    polygons.insert(polygons.end(), {star, comb, spiral});
  }
  polygons.push_back({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {2, 0, 0}, {0, 4, 0}});
  for (const auto& polygon : polygons) {
    Vec3 whole;
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) whole += area_vector(polygon[0], polygon[i], polygon[i + 1]);
    double absolute = 0;
    for (const auto& [a, b, c] : geometry::triangulate(polygon))
      absolute += math::length(area_vector(polygon[a], polygon[b], polygon[c]));
    CHECK(absolute == doctest::Approx(math::length(whole)));
  }
}

TEST_CASE("a ray through the shared edge or a corner meets exactly one of the triangles") {
  const Vec3 a{0, 0, 0}, b{1, 0, 0}, c{1, 1, 0}, d{0, 1, 0};
  for (const Vec3& target : {Vec3{0.5, 0.5, 0}, Vec3{0.25, 0.25, 0}, Vec3{0.75, 0.75, 0}}) {
    for (const bool is_flipped : {false, true}) {
      const geometry::PreparedRay ray({0.3, 0.1, 2}, target - Vec3{0.3, 0.1, 2});
      const geometry::TriangleVertices first{a, b, c},
          second = is_flipped ? geometry::TriangleVertices{a, d, c} : geometry::TriangleVertices{a, c, d};
      CHECK(intersect(first, ray, math::infinity).has_value() + intersect(second, ray, math::infinity).has_value() ==
            1);
    }
  }
  // A fan of eight around a vertex.
  int hits = 0;
  for (int i = 0; i < 8; ++i) {
    const auto at = [](int k) {
      const auto [sine, cosine] = math::sine_cosine_turns(k / 8.0);
      return Vec3{cosine, sine, 0};
    };
    if (geometry::intersect({{0, 0, 0}, at(i), at(i + 1)}, {{0, 0, 1}, {0, 0, -1}}, math::infinity)) ++hits;
  }
  CHECK(hits == 1);
}

TEST_CASE("triangle hits agree with long double") {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vec3{uniform(random), uniform(random), uniform(random)}; };
  for (int i = 0; i < 20'000; ++i) {
    const geometry::TriangleVertices t{vector(), vector(), vector()};
    const Vec3 origin = vector() * 5, direction = (t.v0 + t.v1 + t.v2) * (1.0 / 3) - origin;
    const auto hit = intersect(t, {origin, direction}, math::infinity);
    REQUIRE(hit);
    // Aimed at the centroid: t = 1 and equal weights.
    CHECK(hit->t == doctest::Approx(1).epsilon(1e-9));
    const Vec3 p = point_on(t, hit->b1, hit->b2).position;
    CHECK(math::length(p - (origin + direction * hit->t)) < 1e-12);
  }
}

TEST_CASE("a cylinder with caps is closed, rims included; without caps a ray passes along its inside") {
  const geometry::CylinderShape can{{0, 0, 0}, {0, 0, 1}, 1, 2, true}, pipe{{0, 0, 0}, {0, 0, 1}, 1, 2, false};
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> uniform;
  for (int i = 0; i < 20'000; ++i) {
    // Aimed at the rims from outside, or any point inside: from outside in and out again, from inside out once.
    const auto [sine, cosine] = math::sine_cosine_turns(uniform(random));
    const Vec3 rim{cosine, sine, i % 2 == 0 ? 0.0 : 2.0};
    const Vec3 inside{0.5 * uniform(random), 0.5 * uniform(random), 0.5 + uniform(random)};
    CHECK(crossings(can, {inside, rim - inside}, std::nullopt).count == 1);
    const Vec3 outside = inside + (rim - inside) * 5;
    CHECK(crossings(can, {outside, inside - outside}, std::nullopt).count == 2);
  }
  CHECK(crossings(pipe, {{0.2, 0.1, -3}, {0, 0, 1}}, std::nullopt).count == 0);
  CHECK(crossings(can, {{0.2, 0.1, -3}, {0, 0, 1}}, std::nullopt).count == 2);
  const auto side = crossings(pipe, {{-3, 0, 1}, {1, 0, 0}}, std::nullopt);
  CHECK(side.count == 2);
  CHECK(side.t[0] == doctest::Approx(2));
  CHECK(side.t[1] == doctest::Approx(4));
}

TEST_CASE(
    "far away, where a point rounds onto the axis or the center, a thin shape has a unit normal across its axis") {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 200; ++i) {
    const Vec3 far = Vec3{uniform(random), uniform(random), uniform(random)} * 1e12;
    const Vec3 axis = math::normalize({uniform(random), uniform(random), uniform(random)});
    const Vec3 along = i % 2 == 0 ? axis : Vec3{0, 0, 1};
    const auto check = [&](const geometry::SurfacePoint& point, double slope) {
      CHECK(math::length(point.normal) == doctest::Approx(1));
      CHECK(std::fabs(slope) < 1e-12);
      CHECK(point.shading_normal == point.normal);
      CHECK(math::length(point.position - far) < 1e-3);
    };
    const auto tube = surface_at(geometry::TubeShape{far, along, 1e-9}, far, 0);
    check(tube, math::dot(tube.normal, along));
    const auto can = surface_at(geometry::CylinderShape{far, along, 1e-9, 1, true}, far, geometry::cylinder_side);
    check(can, math::dot(can.normal, along));
    check(surface_at(geometry::SphereShape{far, 1e-9}, far, 0), 0);
  }
}
