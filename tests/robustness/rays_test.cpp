// Recipes 2, 4, 5 and 6 of the numerics: rays that start on surfaces, in planes of boxes, at no number at all, and far
// away.
#include <doctest/doctest.h>

#include <array>

#include "engine/accel/triangle_lanes.h"
#include "engine/math/constants.h"
#include "tests/robustness/kernels.h"
#include "tests/robustness/worlds.h"

using namespace penumbra;
using test::Vec3;

namespace {

/// One of every shape around `center`, about `size` large.
std::vector<scene::Object> every_shape(const Vec3& c, double s) {
  scene::Mesh mesh;
  mesh.positions = {c, c + Vec3{s, 0, 0}, c + Vec3{0, s, 0}, c + Vec3{0, 0, s}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  scene::Group squeezed;
  squeezed.transform = {{{1, 0.25, 0}, {0, 0.5, 0}, {0.25, 0, 1}}, {}};
  squeezed.transform.translation = c - squeezed.transform.vector(c);
  squeezed.objects = {{scene::Sphere{c, s}, {}}};
  return {{scene::Sphere{c, s}, {}},
          {scene::Plane{c, {1, 2, 3}}, {}},
          {scene::Triangle{{c + Vec3{s, 0, 0}, c + Vec3{0, s, 0}, c + Vec3{0, 0, s}}}, {}},
          {scene::Polygon{{c + Vec3{-s, -s, 0}, c + Vec3{s, -s, 0}, c + Vec3{s, s, 0}, c + Vec3{-s, s, 0}}}, {}},
          {scene::Tube{c, {1, 1, 0.5}, s}, {}},
          {scene::Cylinder{c, {0.2, 1, 0.1}, s, s, true}, {}},
          {scene::Cylinder{c, {0.2, 1, 0.1}, s, s, false}, {}},
          {mesh, {}},
          {std::move(squeezed), {}}};
}

/// Many small and some large shapes, some of glass, some placed, around the origin.
scene::Description cluttered(test::Random& random) {
  scene::Description description = test::with_objects({});
  scene::Material glass;
  glass.transmission = {0.5, 0.25, 0.75};
  description.materials.push_back(glass);
  for (int i = 0; i < 120; ++i) {
    const auto shapes = every_shape(random.in_cube(4), random.between(0.05, i % 10 == 0 ? 2 : 0.5));
    scene::Object object = shapes[static_cast<std::size_t>(random.below(9))];
    if (std::holds_alternative<scene::Plane>(object.shape) || std::holds_alternative<scene::Tube>(object.shape)) {
      if (i > 20) continue;  // enough of those without an end
    }
    object.material = scene::MaterialId{random.below(3) == 0 ? 1u : 0u};
    description.objects.push_back(std::move(object));
  }
  return description;
}

}  // namespace

TEST_CASE("recipe 2: a ray that leaves a surface does not meet it again where it started") {
  const int rays = test::count(5'000, 200'000);
  for (const std::int64_t instructions : test::kernels())
    for (const double magnitude : {1e-8, 1.0, 1e8}) {
      for (const double size : {magnitude, 1.0}) {
        const test::Kernel kernel(instructions);
        // One unit large, 10⁸ units away: what is left of the shape is its leading eight digits.
        if (size < magnitude * 1e-8 || (size > magnitude && magnitude < 1)) continue;
        const Vec3 center = Vec3{0.3, -0.5, 0.8} * magnitude;
        const auto shapes = every_shape(center, size);
        for (std::size_t shape = 0; shape < shapes.size(); ++shape) {
          const shading::Scene scene = test::compiled(test::with_objects({shapes[shape]}));
          test::Random random(shape);
          int hits = 0, again = 0;
          for (int i = 0; i < rays; ++i) {
            const Vec3 origin = center + random.direction() * (3 * size);
            const Vec3 target = center + random.in_cube(0.7 * size);
            const geometry::Ray ray{origin, math::normalize(target - origin), {}};
            const auto hit = closest_hit(scene.world, ray);
            if (!hit) continue;
            ++hits;
            const geometry::SurfacePoint at = surface_at(scene.world, ray, *hit);
            for (int k = 0; k < 4; ++k) {
              const Vec3 direction = random.direction();
              if (std::fabs(math::dot(direction, at.normal)) < 1e-3) continue;
              const geometry::Ray leaving{leave_surface(at, direction), direction, hit->surface};
              const auto next = closest_hit(scene.world, leaving);
              if (next && next->t < 1e-6 * size && !(next->t > 64 * math::length(at.error))) ++again;
            }
          }
          INFO(test::name_of(instructions), ", shape ", shape, ", coordinates ", magnitude, ", size ", size);
          CHECK(hits > rays / 20);
          CHECK(again == 0);
        }
      }
    }
}

TEST_CASE(
    "recipe 4: axis and diagonal directions from the planes of boxes: every structure finds what brute force finds") {
  test::Random random(4);
  std::vector<scene::Object> objects;
  for (int i = 0; i < 60; ++i) {
    const Vec3 p{std::floor(random.between(-8, 8)), std::floor(random.between(-8, 8)),
                 std::floor(random.between(-8, 8))};
    objects.push_back({scene::Triangle{{p, p + Vec3{1, 0, 0}, p + Vec3{0, 1, 1}}}, {}});
    objects.push_back({scene::Triangle{{p, p + Vec3{1, 1, 0}, p + Vec3{0, 1, 0}}}, {}});
    if (i % 4 == 0) objects.push_back({scene::Sphere{p, 1}, {}});
  }
  const scene::Description description = test::with_objects(std::move(objects));
  std::vector<shading::Scene> scenes;
  for (const auto acceleration : test::accelerations) scenes.push_back(test::compiled(description, acceleration));
  std::vector<Vec3> directions;
  for (const double x : {-1.0, -1e-38, -0.0, 0.0, 1e-38, 1.0}) {
    for (const double y : {-1.0, -1e-38, -0.0, 0.0, 1e-38, 1.0}) {
      for (const double z : {-1.0, -1e-38, -0.0, 0.0, 1e-38, 1.0}) {
        if (math::max_component(math::abs(Vec3{x, y, z})) == 1) directions.push_back({x, y, z});
      }
    }
  }
  int different = 0, hits = 0;
  for (const std::int64_t instructions : test::kernels())
    for (int i = 0; i < test::count(300, 20'000); ++i) {
      const test::Kernel kernel(instructions);
      const Vec3 origin{std::floor(random.between(-9, 9)), std::floor(random.between(-9, 9)),
                        std::floor(random.between(-9, 9))};
      for (const Vec3& direction : directions) {
        const auto brute = closest_hit(scenes[0].world, {origin, direction, {}});
        if (brute) ++hits;
        for (const shading::Scene& scene : scenes) {
          const auto found = closest_hit(scene.world, {origin, direction, {}});
          if (found.has_value() != brute.has_value() ||
              (found && (found->t != brute->t || found->surface != brute->surface)))
            ++different;
        }
      }
    }
  CHECK(hits > 1000);
  CHECK(different == 0);
}

TEST_CASE("recipe 4: a direction of any length, along an axis or nearly so, finds what brute force finds") {
  test::Random random(41);
  const scene::Description description = cluttered(random);
  const shading::Scene plain = test::compiled(description, scene::Acceleration::none),
                       best = test::compiled(description);
  int different = 0, hits = 0;
  for (const std::int64_t instructions : test::kernels()) {
    const test::Kernel kernel(instructions);
    for (int i = 0; i < test::count(2'000, 100'000); ++i) {
      const Vec3 origin = i % 5 == 0 ? random.in_cube(4) : random.direction() * random.between(1, 200);
      Vec3 direction = i % 5 == 0 ? random.direction() : math::normalize(random.in_cube(3) - origin);
      // Axes on which it stands still, or moves as much less as is near what the boxes take for standing still.
      for (int axis = 0; axis < 3; ++axis) {
        if (random.below(3) == 0) direction[axis] *= std::ldexp(random.below(2), -random.below(80));
      }
      if (math::max_component(math::abs(direction)) < 0.01) continue;
      direction = direction * std::ldexp(1, random.below(601) - 300);
      const geometry::Ray ray{origin, direction, {}};
      const auto brute = closest_hit(plain.world, ray), found = closest_hit(best.world, ray);
      if (brute) ++hits;
      // Where the compiler fuses, the two forms of a triangle's test may differ in the last bit of t.
      if (found.has_value() != brute.has_value() ||
          (found && (found->surface != brute->surface || std::fabs(found->t - brute->t) > 4e-16 * brute->t)))
        ++different;
    }
  }
  CHECK(hits > 500);
  CHECK(different == 0);
}

#ifdef __FMA__
constexpr double rounding = 1e-13;  // where the compiler fuses, the forms of one test differ in their last bits
#else
constexpr double rounding = 0;
#endif

TEST_CASE("rays in a bundle find what they find alone") {
  test::Random random(42);
  int different = 0, through = 0, crossed_items = 0, nearest = 0;
  const scene::Description description = cluttered(random);
  for (const auto acceleration : {scene::Acceleration::bvh, scene::Acceleration::median}) {
    const shading::Scene scene = test::compiled(description, acceleration);
    for (const std::int64_t instructions : test::kernels()) {
      const test::Kernel kernel(instructions);
      for (int i = 0; i < test::count(2'000, 100'000); ++i) {
        const Vec3 apex = random.direction() * random.between(0.5, i % 7 == 0 ? 200 : 6);
        const Vec3 target = random.in_cube(2), spread = random.in_cube(i % 3 == 0 ? 6 : 0.3);
        const double limit = i % 4 == 0 ? math::infinity : random.between(0.3, 1.5);
        const auto count = static_cast<std::size_t>(1 + random.below(accel::bundle_width));
        accel::Bundle bundle;
        std::vector<geometry::Ray> rays;
        for (std::size_t k = 0; k < count; ++k) {
          const Vec3 from = i % 5 == 0 ? apex + random.in_cube(1e-9) : apex;
          const accel::SurfaceId self{static_cast<std::uint32_t>(random.below(100)), 0};
          rays.push_back({from, target + spread * random.between(-1, 1) + random.in_cube(0.1) - from, self});
          bundle.add(rays.back().origin, rays.back().direction, self);
        }
        std::array<accel::Crossed, accel::bundle_width> together;
        const unsigned found = cross_transparent(scene.world, bundle, limit, together.data());
        for (std::size_t k = 0; k < count; ++k) {
          accel::Crossed alone;
          const bool is_through = cross_transparent(scene.world, rays[k], limit, alone);
          through += is_through ? 1 : 0;
          if (is_through != ((found >> k & 1) != 0) || (is_through && together[k].sorted() != alone.sorted()))
            ++different;
          crossed_items += is_through ? static_cast<int>(alone.sorted().size()) : 0;
        }
        std::array<accel::Hit, accel::bundle_width> hits;
        const unsigned met = closest_hits(scene.world, bundle, hits.data());
        std::array<geometry::SurfacePoint, accel::bundle_width> points;
        surfaces_at(scene.world, bundle, met, hits.data(), points.data());
        for (std::size_t k = 0; k < count; ++k) {
          const auto alone = closest_hit(scene.world, rays[k]);
          nearest += alone ? 1 : 0;
          if (((met >> k & 1) != 0) != alone.has_value()) ++different;
          if (((met >> k & 1) == 0) || !alone) continue;
          const geometry::SurfacePoint point = surface_at(scene.world, rays[k], *alone);
          if (hits[k].surface != alone->surface || std::fabs(hits[k].t - alone->t) > rounding * alone->t ||
              math::length(points[k].position - point.position) > rounding * math::length(point.position) ||
              math::length(points[k].shading_normal - point.shading_normal) > rounding)
            ++different;
        }
      }
    }
  }
  CHECK(through > 1000);
  CHECK(crossed_items > 500);
  CHECK(nearest > 1000);
  CHECK(different == 0);
}

TEST_CASE("recipe 5: rays that are no numbers end, and find nothing or something finite") {
  const double nan = std::nan(""), inf = math::infinity;
  for (const std::int64_t instructions : test::kernels())
    for (const auto acceleration : test::accelerations) {
      const test::Kernel kernel(instructions);
      const shading::Scene scene = test::compiled(test::with_objects(every_shape({0, 0, 0}, 1)), acceleration);
      for (const double bad : {nan, inf, -inf, 0.0, 1e308, 5e-324}) {
        for (int place = 0; place < 6; ++place) {
          Vec3 origin{0.1, 0.2, -5}, direction{0.01, 0.02, 1};
          (place < 3 ? origin : direction)[place % 3] = bad;
          const auto hit = closest_hit(scene.world, {origin, direction, {}});
          if (hit) CHECK(hit->t > 0);
          accel::Crossed crossed;
          cross_transparent(scene.world, {origin, direction, {}}, 1, crossed);
        }
      }
      CHECK_FALSE(closest_hit(scene.world, {{nan, nan, nan}, {nan, nan, nan}, {}}));
      CHECK_FALSE(closest_hit(scene.world, {{0, 0, -5}, {0, 0, 0}, {}}));
    }
}

TEST_CASE("recipe 6: spheres far away, against long double") {
  test::Random random(6);
  for (double ratio = 1e2; ratio <= 1e7; ratio *= 10) {
    const geometry::SphereShape sphere{{0.25, -0.5, 0.125}, 1};
    double worst_ulp = 0, worst_radius = 0;
    for (int i = 0; i < test::count(50'000, 1'000'000); ++i) {
      const Vec3 from = sphere.center + random.direction() * ratio;
      const bool is_grazing = i % 2 == 1;
      const Vec3 to_center = math::normalize(sphere.center - from);
      const Vec3 aside = math::normalize(math::cross(to_center, random.direction()));
      const Vec3 target = sphere.center + aside * (is_grazing ? random.between(0.999, 1) : random.between(0, 0.1));
      const Vec3 d = math::normalize(target - from);
      const auto found = crossings(sphere, {from, d}, std::nullopt);
      if (found.count != 2) continue;
      if (is_grazing) {
        const auto at = surface_at(sphere, from + d * found.t[0], 0);
        worst_radius = std::max(worst_radius, std::fabs(math::length(at.position - sphere.center) - 1));
        continue;
      }
      using Long = long double;
      const Long fx = Long(from.x) - sphere.center.x, fy = Long(from.y) - sphere.center.y,
                 fz = Long(from.z) - sphere.center.z;
      const Long a = Long(d.x) * d.x + Long(d.y) * d.y + Long(d.z) * d.z, b = fx * d.x + fy * d.y + fz * d.z;
      const Long lx = fx - b / a * d.x, ly = fy - b / a * d.y, lz = fz - b / a * d.z;
      const Long exact = (-b - std::sqrt(a * (1 - (lx * lx + ly * ly + lz * lz)))) / a;
      const double ulp = std::nextafter(ratio, math::infinity) - ratio;
      worst_ulp = std::max(worst_ulp, static_cast<double>(std::fabs(found.t[0] - exact)) / ulp);
    }
    MESSAGE("distance ", ratio, " radii: t within ", worst_ulp, " ulp of the distance, grazing hits off by ",
            worst_radius / 2.2e-16, " epsilon");
    CHECK(worst_ulp <= 4);
    CHECK(worst_radius <= 8 * 2.220446049250313e-16);
  }
}

TEST_CASE("places on triangles side by side are those of each, whatever their size") {
  test::Random random(29);
  int degenerate = 0, different = 0;
  for (const std::int64_t instructions : test::kernels()) {
    const test::Kernel kernel(instructions);
    for (int i = 0; i < 400; ++i) {
      accel::TriangleLanes lanes;
      std::array<geometry::SurfacePoint, accel::bundle_width> alone;
      for (std::size_t k = 0; k < accel::bundle_width; ++k) {
        // From where a square is no number to where it is none but 0, with edges that are nearly or wholly alike.
        const double size = std::ldexp(1.0, i % 3 == 0 ? 0 : random.below(1000) - 500);
        const Vec3 a = random.in_cube(size), b = random.in_cube(size);
        const Vec3 c =
            i % 4 == 0 ? a + (b - a) * (i % 8 == 0 ? 1 : 1 + random.between(0, 1e-12)) : random.in_cube(size);
        const double b1 = random.between(0, 1), b2 = random.between(0, 1 - b1);
        lanes.set(k, {a, b, c}, b1, b2);
        alone[k] = point_on(geometry::TriangleVertices{a, b, c}, b1, b2);
        degenerate += alone[k].normal == Vec3{} ? 1 : 0;
      }
      accel::PlaceLanes places;
      find_places(lanes, places);
      for (std::size_t k = 0; k < accel::bundle_width; ++k) {
        const geometry::SurfacePoint point = places[k];
        const auto differ = [](const Vec3& x, const Vec3& y) {
          return !(math::length(x - y) <= rounding * math::length(y));
        };
        if (differ(point.position, alone[k].position) || differ(point.error, alone[k].error) ||
            differ(point.normal, alone[k].normal) || !(point.normal == point.shading_normal))
          ++different;
      }
    }
  }
  CHECK(degenerate > 100);
  CHECK(different == 0);
}
