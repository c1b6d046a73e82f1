// Cells: their hulls hold every segment to the light, and their lists all that the points would find on their own.
#include "engine/shading/shadows/cell.h"

#include <doctest/doctest.h>

#include <algorithm>

#include "engine/accel/queries.h"
#include "engine/math/elementary.h"
#include "engine/shading/shadows/candidates.h"
#include "tests/robustness/worlds.h"
#include "tests/support/scenes.h"

using namespace penumbra;
namespace shadows = penumbra::shading::shadows;
using math::Vec3;

namespace {

Vec3 in_ball(test::Random& random, double radius) {
  for (;;) {
    const Vec3 p = random.in_cube(radius);
    if (math::length(p) <= radius) return p;
  }
}

/// Where a segment from `from` to somewhere in the target is at a random share of its length.
Vec3 on_segment(test::Random& random, const Vec3& from, const shadows::Target& target) {
  const Vec3 to = target.center + in_ball(random, target.radius);
  return target.is_infinite ? from + to * (random.between(0, 1) * 50) : from + (to - from) * random.between(0, 1);
}

shadows::Target random_target(test::Random& random, bool is_infinite) {
  if (!is_infinite) return {random.in_cube(8), random.between(0, 2), false};
  return {random.direction(), random.between(0, 0.3), true};
}

geometry::TriangleVertices speck(const Vec3& p) { return {p, p, p}; }

}  // namespace

TEST_CASE("hulls hold all segments from the cell to the target") {
  test::Random random(11);
  int flat = 0, round = 0, rejected = 0;
  for (int i = 0; i < 2000; ++i) {
    shadows::Target target = random_target(random, i % 3 == 0);
    const math::Frame frame = math::frame_around(random.direction());
    const Vec3 middle = random.in_cube(4);
    const double size = random.between(0.01, 1);
    // Also nearer than the cell is wide.
    if (i % 3 == 1) target = {middle + in_ball(random, 1.5 * size), random.between(0, 0.3 * size), false};
    const Vec3 u = frame.u * size, v = frame.v * size;
    const shadows::FlatCell square{{middle - u - v, middle + u - v, middle + u + v, middle - u + v}, frame.n};
    const shadows::RoundCell ball{middle, size};
    const auto flat_hull = hull(square, target), round_hull = hull(ball, target);
    for (int k = 0; k < 20; ++k) {
      if (flat_hull) {
        ++flat;
        const Vec3 from = middle + u * random.between(-1, 1) + v * random.between(-1, 1);
        CHECK_FALSE(flat_hull->miss(speck(on_segment(random, from, target) + frame.n * 1e-9)));
      }
      if (round_hull) {
        ++round;
        CHECK_FALSE(round_hull->miss(speck(on_segment(random, middle + in_ball(random, size), target))));
        rejected += round_hull->miss(speck(random.in_cube(8))) ? 1 : 0;
      }
    }
  }
  CHECK(flat > 5000);
  CHECK(round > 10000);
  CHECK(rejected > round / 2);
}

TEST_CASE("a cylinder that a segment of the hull touches is not missed, and its box tells less than itself") {
  test::Random random(13);
  int touched = 0, missed = 0, missed_by_box = 0;
  for (int i = 0; i < 20000; ++i) {
    const shadows::Target target = random_target(random, i % 3 == 0);
    const shadows::RoundCell ball{random.in_cube(4), random.between(0.01, 1)};
    const auto region = hull(ball, target);
    if (!region) continue;
    const Vec3 axis = i % 4 == 0 ? Vec3{0, 0, 1} : random.direction();
    geometry::CylinderShape cylinder{{}, axis, random.between(0.001, 1), random.between(0.001, 4), true};
    // A point of its surface where a segment of the hull is.
    const math::Frame frame = math::frame_around(axis);
    const double turn = random.between(0, 6.3);
    const Vec3 offset = frame.u * (std::cos(turn) * cylinder.radius) + frame.v * (std::sin(turn) * cylinder.radius);
    const Vec3 at = on_segment(random, ball.center + in_ball(random, ball.radius), target);
    cylinder.base = at - offset - axis * (random.below(3) * 0.5 * cylinder.height);
    CHECK_FALSE(region->miss(cylinder));
    ++touched;
    cylinder.base = random.in_cube(8);
    missed += region->miss(cylinder) ? 1 : 0;
    missed_by_box += region->miss(*geometry::bounds_of(cylinder)) ? 1 : 0;
  }
  CHECK(touched > 10000);
  CHECK(missed > missed_by_box);
}

TEST_CASE("what lies within a hull's limits lies before the target as every point of the cell sees it") {
  test::Random random(12);
  int within = 0;
  for (int i = 0; i < 20000; ++i) {
    const shadows::Target target = random_target(random, false);
    const shadows::RoundCell ball{random.in_cube(4), random.between(0.01, 1)};
    const auto region = hull(ball, target);
    const geometry::TriangleVertices triangle{random.in_cube(12), random.in_cube(12), random.in_cube(12)};
    if (!region || !region->is_within_limits(triangle)) continue;
    ++within;
    const Vec3 way = target.center - (ball.center + in_ball(random, ball.radius));
    for (const Vec3& vertex : {triangle.v0, triangle.v1, triangle.v2})
      CHECK(math::dot(vertex - target.center, way) < 0);
  }
  CHECK(within > 1000);
}

TEST_CASE("hulls end behind the target, and their limits leave out little before it") {
  test::Random random(15);
  for (int i = 0; i < 2000; ++i) {
    const math::Frame frame = math::frame_around(random.direction());
    const double size = random.between(0.01, 0.3), away = random.between(2, 8);
    const Vec3 u = frame.u * size, v = frame.v * size;
    const shadows::FlatCell square{{-u - v, u - v, u + v, -u + v}, frame.n};
    const Vec3 aside = frame.u * random.between(-2, 2) + frame.v * random.between(-2, 2);
    const shadows::Target target{frame.n * away + aside, random.between(0, 0.5), false};
    const double distance = math::length(target.center);
    const Vec3 way = target.center * (1 / distance);
    const math::Frame around = math::frame_around(way);
    // The ball around the square has the radius √2 size; the hull goes by it.
    const double tangent = 1.01 * std::sqrt(2.0) * size / std::sqrt(distance * distance - 2 * size * size);
    const double x = random.between(-1, 1), y = random.between(-1, 1);
    const double before = tangent * (std::fabs(x) + std::fabs(y)) + 1e-6;
    const shadows::RoundCell ball{{}, std::sqrt(2.0) * size};
    for (const auto& region : {hull(square, target), hull(ball, target)}) {
      REQUIRE(region);
      CHECK(region->miss(speck(target.center + way * (target.radius + 1e-6))));
      CHECK(region->is_within_limits(speck(target.center + around.u * x + around.v * y - way * before)));
    }
  }
}

TEST_CASE("a view cone tells which spheres meet all of its segments and which meet none") {
  test::Random random(13);
  int covered = 0, missed = 0;
  for (int i = 0; i < 20000; ++i) {
    const shadows::Target target = random_target(random, i % 3 == 0);
    const shadows::ViewCone cone = shadows::ViewCone::around(target.center, target.radius, target.is_infinite);
    const Vec3 center = random.in_cube(6);
    const double radius = random.between(0, 4);
    const bool covers = cone.is_covered_by(center, radius), misses = cone.misses(center, radius);
    CHECK_FALSE((covers && misses));
    covered += covers ? 1 : 0, missed += misses ? 1 : 0;
    for (int k = 0; k < 10 && (covers || misses); ++k) {
      const Vec3 end = target.center + in_ball(random, target.radius);
      const double t = math::dot(end, center) / math::dot(end, end);
      const double nearest = std::clamp(t, 0.0, target.is_infinite ? math::infinity : 1.0);
      CHECK((math::length(end * nearest - center) < radius) == covers);
    }
  }
  CHECK(covered > 200);
  CHECK(missed > 5000);
}

TEST_CASE("an edge whose line is said to miss the disc has no point in it") {
  test::Random random(45);
  int missing = 0, clear = 0, wrong = 0;
  for (int i = 0; i < 200'000; ++i) {
    // Through a tangent's surroundings, as near as a few roundings; short and long; some of it behind the apex.
    const auto [sine, cosine] = math::sine_cosine_turns(random.between(0, 1));
    const double off = std::ldexp(random.between(-1, 1), -random.below(54));
    const auto point = [&](double along) {
      const double depth = random.between(i % 3 == 0 ? -1 : 0.01, 1);
      return Vec3{cosine * (1 + off) - sine * along, sine * (1 + off) + cosine * along, 1} * depth;
    };
    const double length = std::ldexp(random.between(0, 1), 4 - random.below(40)), start = random.between(-2, 2);
    const Vec3 a = point(start), b = point(start + length);
    clear += off > 1e-9 && length > 1e-3 ? 1 : 0;
    if (!shadows::misses_disc(a, b)) continue;
    ++missing;
    for (int k = 0; k <= 8; ++k) {
      // In extended precision enough is left of a distance of some roundings.
      const auto t = static_cast<long double>(k) / 8;
      const auto mix = [&](double p, double q) { return p + (static_cast<long double>(q) - p) * t; };
      const long double x = mix(a.x, b.x), y = mix(a.y, b.y), z = mix(a.z, b.z);
      if (z > 0 && x * x + y * y <= z * z) ++wrong;
    }
  }
  CHECK(wrong == 0);
  CHECK(missing > clear * 9 / 10);
  CHECK(missing > 10'000);
}

namespace {

/// Of the edges in sight of the disc, which both must hold.
std::size_t count_edges_of_both(const shadows::Candidates& alone, const shadows::Candidates& shared) {
  const auto is_in_disc = [](const Vec3& p) { return p.z > 0 && p.x * p.x + p.y * p.y < p.z * p.z; };
  const auto meets_disc = [&](const shadows::SilhouetteEdge& edge) {
    for (int k = 0; k <= 64; ++k) {
      if (is_in_disc(edge.from + (edge.to - edge.from) * (k / 64.0))) return true;
    }
    return false;
  };
  const auto same = [](const shadows::SilhouetteEdge& a) {
    return [&a](const shadows::SilhouetteEdge& b) {
      return a.place == b.place && a.from == b.from && a.to == b.to && a.jump == b.jump;
    };
  };
  std::size_t edges = 0;
  for (const shadows::SilhouetteEdge& edge : alone.silhouette()) {
    if (!meets_disc(edge)) continue;
    ++edges;
    CHECK(std::ranges::any_of(shared.silhouette(), same(edge)));
  }
  for (const shadows::SilhouetteEdge& edge : shared.silhouette()) {
    if (meets_disc(edge)) CHECK(std::ranges::any_of(alone.silhouette(), same(edge)));
  }
  return edges;
}

}  // namespace

TEST_CASE("a cell's outline has every silhouette edge that its points find, to the last bit") {
  test::Random random(14);
  std::size_t edges = 0, outlined = 0;
  for (const char* name : {"cow", "teapot", "room-flat"}) {
    scene::Description description = test::example(name).scene;
    scene::PointLight soft;
    soft.radius = 1;
    description.lights.push_back(soft);  // so that silhouettes are asked for
    const shading::Scene scene = test::compiled(description);
    const math::Bounds bounds = bounds_of(scene.world.structure);
    const double size = math::max_component(bounds.extent());
    for (int i = 0; i < 1000; ++i) {
      const Vec3 from = bounds.center() + random.in_cube(size);
      const accel::Ray ray{from, math::normalize(bounds.center() + random.in_cube(size / 4) - from), {}};
      const auto hit = accel::closest_hit(scene.world, ray);
      if (!hit) continue;
      const geometry::SurfacePoint surface = accel::surface_at(scene.world, ray, *hit);
      const Vec3 facing = math::dot(surface.normal, ray.direction) > 0 ? -surface.normal : surface.normal;
      const shadows::Target target{surface.position + (facing + random.in_cube(0.8)) * (size * random.between(0.2, 1)),
                                   size * random.between(0.001, 0.1)};
      const double radius = size * random.between(0.0001, 0.03);
      const shadows::RoundCell cell{surface.position + in_ball(random, radius * 0.99), radius};
      const shadows::CellContents contents = shadows::CellContents::outlined(scene.world, cell, target);
      if (contents.outline() == nullptr) continue;
      ++outlined;
      const Vec3 apex = geometry::leave_surface(surface, facing), axis = target.center - apex;
      const math::Frame frame = math::frame_around(math::normalize(axis));
      const Vec3 u = frame.u * target.radius, v = frame.v * target.radius;
      const double volume = 1 / math::dot(axis, math::cross(u, v));
      const double rounding = 2 * math::taxicab(apex - surface.position);
      const shadows::Projection projection{apex,
                                           math::cross(v, axis) * volume,
                                           math::cross(axis, u) * volume,
                                           math::cross(u, v) * volume,
                                           false,
                                           rounding,
                                           shadows::ViewCone::around(axis, target.radius, false)};
      const Vec3 middle = target.center;
      const shadows::Shaft shaft({apex, rounding}, {middle - u - v, middle + u - v, middle + u + v, middle - u + v},
                                 false);
      shadows::Candidates alone, shared;
      alone.gather_silhouettes(scene.world, shaft, projection, hit->surface, false);
      shared.gather_silhouettes(scene.world, shaft, projection, hit->surface, false, &contents);
      if (alone.is_incomplete()) continue;
      CHECK_FALSE(shared.is_incomplete());
      // What hides all ends the search, where a triangle does that its edges alone are of no use.
      if (alone.is_dark()) CHECK((shared.is_dark() || shared.has_opaque_triangles()));
      if (shared.is_dark()) CHECK(alone.is_dark());
      if (alone.is_dark()) continue;
      edges += count_edges_of_both(alone, shared);
    }
  }
  MESSAGE(outlined, " cells, ", edges, " silhouette edges in sight of the light");
  CHECK(outlined > 200);
  CHECK(edges > 500);
}

TEST_CASE("an edge is in the disc where some point of it is") {
  test::Random random(11);
  int inside = 0;
  for (int i = 0; i < 20000; ++i) {
    // Some behind the apex, some of them in part.
    const auto point = [&] {
      const double z = random.between(-0.3, 1);
      return math::Vec3{random.between(-2, 2) * z, random.between(-2, 2) * z, z};
    };
    const math::Vec3 from = point(), to = point();
    bool is_found = false, is_near = false;
    for (int k = 0; k <= 1000; ++k) {
      const math::Vec3 p = from + (to - from) * (k / 1000.0);
      const double beyond = p.x * p.x + p.y * p.y - p.z * p.z;
      is_found = is_found || (p.z > 0 && beyond < 0);
      is_near = is_near || (p.z > -1e-2 && beyond < 1e-2);
    }
    if (is_found) CHECK(shadows::is_in_disc(from, to));
    if (!is_near) CHECK_FALSE(shadows::is_in_disc(from, to));
    inside += is_found ? 1 : 0;
  }
  CHECK(inside > 2000);
}

TEST_CASE("a triangle meets the disc's cone where some point of it before the disc does") {
  test::Random random(16);
  int met = 0, missed = 0;
  for (int i = 0; i < 20'000; ++i) {
    const double reach = i % 3 == 0 ? 0.5 : 3;
    const Vec3 middle{random.between(-1, 1), random.between(-1, 1), random.between(-0.5, 1.5)};
    const std::array<Vec3, 3> v{middle + random.in_cube(reach), middle + random.in_cube(reach),
                                middle + random.in_cube(reach)};
    bool is_found = false, is_near = false;
    constexpr int steps = 40;
    for (int a = 0; a <= steps; ++a) {
      for (int b = 0; a + b <= steps; ++b) {
        const Vec3 p =
            v[0] + (v[1] - v[0]) * (static_cast<double>(a) / steps) + (v[2] - v[0]) * (static_cast<double>(b) / steps);
        const double out = std::sqrt(p.x * p.x + p.y * p.y) - p.z, room = 6 * reach / steps;
        is_found = is_found || (p.z > 0 && p.z < 1 && out < 0);
        is_near = is_near || (p.z > -room && p.z < 1 + room && out < 2 * room);
      }
    }
    const bool meets = shadows::meets_cone(v);
    if (is_found) CHECK(meets);
    if (!is_near) CHECK_FALSE(meets);
    met += is_found ? 1 : 0, missed += is_near ? 0 : 1;
  }
  CHECK(met > 2000);
  CHECK(missed > 2000);
}
