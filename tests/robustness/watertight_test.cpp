// Recipe 1: rays aimed at the vertices and edges of closed meshes, far from the origin too: none slips through.
#include <doctest/doctest.h>

#include "engine/math/constants.h"
#include "engine/math/elementary.h"
#include "tests/robustness/kernels.h"
#include "tests/robustness/worlds.h"

using namespace penumbra;
using test::Vec3;

namespace {

/// A closed bumpy ball of radius 2 to 5 around `center`.
scene::Mesh bumpy_ball(const Vec3& center, test::Random& random) {
  constexpr std::uint32_t n = 16;
  scene::Mesh mesh;
  mesh.positions.push_back(center + Vec3{0, 0, 2});
  for (std::uint32_t ring = 1; ring < n; ++ring) {
    for (std::uint32_t k = 0; k < n; ++k) {
      const auto [st, ct] = math::sine_cosine_turns(0.5 * ring / n);
      const auto [sp, cp] = math::sine_cosine_turns(1.0 * k / n);
      const double r = random.between(2, 5);
      mesh.positions.push_back(center + Vec3{st * cp, st * sp, ct} * r);
    }
  }
  mesh.positions.push_back(center + Vec3{0, 0, -2});
  const std::uint32_t last = static_cast<std::uint32_t>(mesh.positions.size()) - 1;
  const auto at = [](std::uint32_t ring, std::uint32_t k) { return 1 + (ring - 1) * n + k % n; };
  for (std::uint32_t k = 0; k < n; ++k) {
    mesh.triangles.push_back({0, at(1, k), at(1, k + 1)});
    mesh.triangles.push_back({last, at(n - 1, k + 1), at(n - 1, k)});
    for (std::uint32_t ring = 1; ring + 1 < n; ++ring) {
      mesh.triangles.push_back({at(ring, k), at(ring + 1, k), at(ring + 1, k + 1)});
      mesh.triangles.push_back({at(ring, k), at(ring + 1, k + 1), at(ring, k + 1)});
    }
  }
  return mesh;
}

}  // namespace

TEST_CASE(
    "no ray aimed at a vertex or an edge leaves a closed mesh unseen, and each leaves it an odd number of times") {
  const int rays = test::count(30'000, 1'000'000);
  for (const double distance : {0.0, 1e3 * 10, 1e6 * 10}) {
    test::Random random(17);
    const Vec3 center = Vec3{0.6, 0.3, -0.74} * distance;
    const scene::Mesh mesh = bumpy_ball(center, random);
    const shading::Scene scene = test::compiled(test::with_objects({{mesh, {}}}));
    const auto position = [&](int triangle, int corner) {
      return mesh.positions[mesh.triangles[static_cast<std::size_t>(triangle)][static_cast<std::size_t>(corner)]];
    };
    const int triangles = static_cast<int>(mesh.triangles.size());
    for (const std::int64_t instructions : test::kernels()) {
      const test::Kernel kernel(instructions);
      int missed = 0, even = 0;
      for (int i = 0; i < 2 * rays; ++i) {
        const int triangle = random.below(triangles), corner = random.below(3);
        const Vec3 a = position(triangle, corner), b = position(triangle, (corner + 1) % 3);
        const Vec3 aim = i < rays ? a : a + (b - a) * random.between(0, 1);
        const Vec3 origin = center + random.in_cube(0.5);
        if (!closest_hit(scene.world, {origin, aim - origin, {}})) ++missed;
        if (i % 50 != 0) continue;
        const geometry::PreparedRay ray(origin, aim - origin);
        int crossings = 0;
        for (int t = 0; t < triangles; ++t) {
          if (intersect({position(t, 0), position(t, 1), position(t, 2)}, ray, math::infinity)) ++crossings;
        }
        if (crossings % 2 == 0) ++even;
      }
      INFO(test::name_of(instructions), ", ", rays, " rays of each kind at distance ", distance);
      CHECK(missed == 0);
      CHECK(even == 0);
    }
  }
}
