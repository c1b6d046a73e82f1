#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>

#include "engine/math/elementary.h"
#include "engine/math/error_free.h"
#include "engine/render/compile.h"
#include "engine/shading/shadows/shadows.h"
#include "tests/robustness/worlds.h"
#include "tests/support/picture.h"

using namespace penumbra;
using math::Color;
using math::Vec3;

namespace {

constexpr int steps = 24;  // of latitude, and half of those of longitude

/// A closed ball with bumps; with `is_open`, a wedge of it is missing.
scene::Mesh bumpy_ball(const Vec3& center, double radius, test::Random& random, bool is_open) {
  scene::Mesh mesh;
  const auto point = [&](double theta, double phi) {
    const double r = radius * random.between(0.7, 1.2);
    const auto t = math::sine_cosine_turns(theta), p = math::sine_cosine_turns(phi);
    return center + Vec3{t.sine * p.cosine, t.cosine, t.sine * p.sine} * r;
  };
  mesh.positions.push_back(point(0, 0));
  for (int i = 1; i < steps; ++i) {
    for (int k = 0; k < 2 * steps; ++k) mesh.positions.push_back(point(0.5 * i / steps, 0.5 * k / steps));
  }
  mesh.positions.push_back(point(0.5, 0));
  const auto at = [](int i, int k) { return static_cast<std::uint32_t>(1 + (i - 1) * 2 * steps + k % (2 * steps)); };
  const auto last = static_cast<std::uint32_t>(mesh.positions.size() - 1);
  for (int k = 0; k < (is_open ? 3 : 4) * steps / 2; ++k) {
    mesh.triangles.push_back({0, at(1, k + 1), at(1, k)});
    mesh.triangles.push_back({last, at(steps - 1, k), at(steps - 1, k + 1)});
    for (int i = 1; i + 1 < steps; ++i) {
      mesh.triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k)});
      mesh.triangles.push_back({at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)});
    }
  }
  return mesh;
}

scene::Object object(scene::Shape shape) { return {std::move(shape), scene::MaterialId{0}}; }

scene::Description world(int seed) {
  test::Random random(static_cast<unsigned long>(seed));
  scene::Description description;
  description.materials.push_back(scene::default_material());
  description.meshes.push_back(bumpy_ball({0, 0, 0}, 1, random, false));
  const auto placed = [&](const Vec3& at, double size) {
    scene::Instance instance{scene::MeshId{0}, {}};
    instance.transform.column[0] = {size, 0.2 * size, 0};
    instance.transform.column[1] = {0, size, 0.1 * size};
    instance.transform.column[2] = {0, 0, seed % 2 == 0 ? size : -size};  // every second world is mirrored
    instance.transform.translation = at;
    return object(instance);
  };
  description.objects.push_back(object(bumpy_ball({-2, 1, 0}, 1, random, false)));
  description.objects.push_back(object(bumpy_ball({0.5, 2.5, 0.5}, 0.6, random, true)));
  description.objects.push_back(placed({2, 1, 0}, 0.8));
  description.objects.push_back(placed({0.5, 0.7, -2}, 0.5));
  description.objects.push_back(object(scene::Sphere{{1, 3, 1.5}, 0.3}));
  description.objects.push_back(object(scene::Triangle{{Vec3{-1, 3, -1}, Vec3{0, 3.2, -1}, Vec3{-0.5, 3.5, 0.4}}}));
  description.objects.push_back(object(scene::Triangle{{Vec3{-9, 0, -9}, Vec3{-9, 0, 9}, Vec3{9, 0, 9}}}));
  description.objects.push_back(object(scene::Triangle{{Vec3{-9, 0, -9}, Vec3{9, 0, 9}, Vec3{9, 0, -9}}}));
  scene::PointLight light;
  light.position = {random.between(-2, 2), random.between(5, 8), random.between(-2, 2)};
  light.radius = random.between(0.2, 1.5);
  light.intensity = math::white;
  description.lights.push_back(light);
  return description;
}

}  // namespace

TEST_CASE("what silhouettes and chords say is what rays say, and certain where they are certain") {
  constexpr int rays = 4096;
  int certain = 0, partial = 0, wrong = 0;
  double squared = 0;
  for (int seed = 1; seed <= test::count(6, 60); ++seed) {
    const scene::Description description = world(seed);
    const shading::Scene scene = test::compiled(description);
    const auto& light = std::get<shading::DiscLight>(scene.lights.front());
    shading::Counters counters;
    const shading::Switches none = test::with_candidates(false);
    const shading::Switches all;
    const std::function<bool()> never = [] { return false; };
    shading::shadows::Shadows swept(scene, all, counters, never), cast(scene, none, counters, never);
    const shading::DiscSampling sampling(1024), dense(rays);
    test::Random random(static_cast<unsigned long>(seed) + 1000);
    for (int i = 0; i < 150; ++i) {
      const Vec3 from{random.between(-4, 4), random.between(0.5, 6), random.between(-4, 4)};
      const Vec3 towards = Vec3{random.between(-3, 3), random.between(0, 1), random.between(-3, 3)} - from;
      const accel::Ray ray{from, math::normalize(towards), {}};
      const auto hit = accel::closest_hit(scene.world, ray);
      if (!hit) continue;
      shading::ShadingPoint at;
      at.surface = accel::surface_at(scene.world, ray, *hit);
      at.id = hit->surface;
      at.material = &scene.materials[0];
      at.view = ray.direction;
      at.facing = math::dot(at.surface.normal, ray.direction) > 0 ? -at.surface.normal : at.surface.normal;
      at.footprint = random.between(0, 0.05);
      const Vec3 axis = light.position - at.surface.position;
      if (!(math::dot(at.facing, axis) > 0)) continue;
      const sampling::Key key = sampling::Key(7).at(static_cast<std::uint64_t>(seed));
      const auto visibility = [&](shading::shadows::Shadows& shadows, const shading::DiscSampling& samples) {
        shading::shadows::Sight sight = shadows.aim(at, 0, {light.position, light.radius}, samples);
        return sight.disc({axis, math::normalize(-axis), light.radius}, samples, {key, static_cast<std::uint64_t>(i)});
      };
      const shading::Visibility is = visibility(swept, sampling), ought = visibility(cast, dense);
      if (is.variance.modelled.r == 0) {
        ++certain;
        // The mean of 4096 equal numbers has roundings of its own.
        wrong += std::fabs(is.mean.r - ought.mean.r) > math::gamma(rays) ? 1 : 0;
      } else {
        ++partial;
        const double difference = is.mean.r - ought.mean.r;
        squared += difference * difference;
      }
    }
  }
  MESSAGE(certain, " points lit or dark for certain, ", partial, " in a penumbra with rms difference ",
          std::sqrt(squared / partial));
  CHECK(wrong == 0);
  CHECK(certain > 100);
  CHECK(partial > 100);
  // 32 chords and 4096 rays through edges that are as ragged as these.
  CHECK(std::sqrt(squared / partial) < 3e-3);
}
