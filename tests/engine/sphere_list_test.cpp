// Spheres between a point and a light: found in lanes as one by one, and dropped only behind larger ones.
#include "engine/shading/shadows/sphere_list.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/robustness/worlds.h"

using namespace penumbra;
namespace shadows = penumbra::shading::shadows;
using math::Vec3;
using shadows::SeenSphere;

namespace {

shadows::Projection projection_to(const Vec3& apex, const Vec3& axis, double radius, bool is_infinite) {
  const math::Frame frame = math::frame_around(math::normalize(axis));
  const Vec3 u = frame.u * radius, v = frame.v * radius;
  const double volume = 1 / math::dot(axis, math::cross(u, v));
  return {apex,
          math::cross(v, axis) * volume,
          math::cross(axis, u) * volume,
          math::cross(u, v) * volume,
          is_infinite,
          0,
          shadows::ViewCone::around(axis, radius, is_infinite)};
}

bool same(const SeenSphere& a, const SeenSphere& b) {
  const auto equal = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  return a.item == b.item && a.center == b.center && a.radius == b.radius && equal(a.tangent, b.tangent) &&
         a.size == b.size;
}

}  // namespace

TEST_CASE("a list of spheres tells to the last bit what each sphere tells alone") {
  test::Random random(21);
  int found = 0, dark = 0, inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 apex = random.in_cube(3), axis = random.direction() * random.between(0.5, 12);
    const bool is_infinite = i % 4 == 0;
    const shadows::Projection projection = projection_to(apex, axis, random.between(0.01, 2), is_infinite);
    const auto count = static_cast<std::uint32_t>(random.below(40));
    const std::uint32_t self = static_cast<std::uint32_t>(random.below(50));
    shadows::SphereList list;
    std::vector<SeenSphere> expected;
    bool covers = false;
    for (std::uint32_t k = 0; k < count; ++k) {
      const geometry::SphereShape sphere{apex + axis * random.between(-0.3, 1.5) + random.in_cube(2),
                                         random.between(0.001, i % 2 == 0 ? 0.5 : 2)};
      const std::uint32_t item = 3 * k;
      list.add(sphere, item);
      CHECK(list.contains(item));
      const shadows::InCone place = place_in(projection, sphere);
      if (place == shadows::InCone::apart || item == self) continue;
      covers = covers || place == shadows::InCone::covers_it;
      expected.emplace_back(sphere, apex, item);
      inside += expected.back().size > 1 ? 1 : 0;
    }
    CHECK(list.size() == count);
    CHECK_FALSE(list.contains(3 * count));
    std::vector<SeenSphere> seen;
    CHECK(list.append(projection, self, seen) == !covers);
    dark += covers ? 1 : 0;
    if (covers) continue;
    found += static_cast<int>(seen.size());
    CHECK(std::ranges::equal(seen, expected, same));
  }
  CHECK(found > 5000);
  CHECK(dark > 100);
  CHECK(inside > 100);
}

TEST_CASE("a sphere is dropped only if every ray that meets it meets a larger one that stays") {
  test::Random random(22);
  std::size_t dropped = 0, rays = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 apex = random.in_cube(5);
    const Vec3 middle = apex + random.direction() * random.between(2, 20);
    std::vector<SeenSphere> all;
    const auto count = static_cast<std::uint32_t>(random.below(60));
    for (std::uint32_t k = 0; k < count; ++k) {
      const double radius = k < 5 ? random.between(0.3, 3) : random.between(0.01, 0.5);
      all.emplace_back(geometry::SphereShape{middle + random.in_cube(2), radius}, apex, k);
    }
    std::vector<SeenSphere> kept = all;
    drop_hidden(kept);
    for (const SeenSphere& sphere : all) {
      if (std::ranges::any_of(kept, [&](const SeenSphere& k) { return k.item == sphere.item; })) continue;
      ++dropped;
      REQUIRE(sphere.size < 1);
      // A direction towards the sphere, out to its rim.
      const math::Frame frame = math::frame_around(math::normalize(sphere.center));
      for (int r = 0; r < 20; ++r) {
        const double turn = random.between(0, 2 * std::numbers::pi), out = r < 10 ? 1 : std::sqrt(random.between(0, 1));
        const double sine = std::sqrt(sphere.size) * out, cosine = std::sqrt(1 - sine * sine);
        const Vec3 d = frame.n * cosine + (frame.u * std::cos(turn) + frame.v * std::sin(turn)) * sine;
        ++rays;
        CHECK(std::ranges::any_of(kept, [&](const SeenSphere& k) {
          const double along = math::dot(k.center, d);
          const Vec3 across = k.center - d * along;
          return k.size >= sphere.size && along > 0 && math::dot(across, across) < k.radius * k.radius;
        }));
      }
    }
  }
  MESSAGE(dropped, " spheres dropped, ", rays, " rays");
  CHECK(dropped > 5000);
}
