// Things that coincide, and lights that lie on things.
#include <doctest/doctest.h>

#include "engine/render/camera.h"
#include "tests/robustness/worlds.h"
#include "tests/support/picture.h"

using namespace penumbra;
using test::Vec3;

namespace {

constexpr double diffuse = 0.8;  // of the default material

api::JobRequest looking_at(const Vec3& eye, const Vec3& at) {
  api::JobRequest job;
  job.scene = test::with_objects({});
  job.scene.camera.position = eye, job.scene.camera.direction = math::normalize(at - eye);
  job.scene.camera.vertical_fov_degrees = 40;
  job.options.width = 40, job.options.height = 30;
  return job;
}

/// What a turned, sheared square of two triangles, a fan, a cap … around the place `at` in a plane with this normal is.
scene::Object flat_with(const Vec3& at, const Vec3& normal, test::Random& random) {
  const math::Frame frame = math::frame_around(normal);
  const auto p = [&](double x, double y) { return at + frame.u * x + frame.v * y; };
  switch (random.below(5)) {
    case 0:
      return {scene::Plane{p(0.3, -0.2), normal}, {}};
    case 1:
      return {scene::Polygon{{p(-2, -1), p(1.5, -1.2), p(1, 2), p(-1, 1.7)}}, {}};
    case 2:
      return {scene::Triangle{{p(-1, -1), p(2, 0), p(-1, 1)}}, {}};
    case 3:
      return {scene::Cylinder{p(0.1, 0.2), normal, 1, 2, true}, {}};
    default: {
      scene::Mesh fan;  // around the light itself
      fan.positions = {at, p(1, 0), p(0, 1), p(-1, 0), p(0, -1)};
      fan.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}};
      return {fan, {}};
    }
  }
}

/// A round thing of which `at` is a point, with this normal there.
scene::Object round_with(const Vec3& at, const Vec3& normal, test::Random& random) {
  const double radius = random.between(0.2, 1);
  const math::Frame frame = math::frame_around(normal);
  const Vec3 middle = at - normal * radius;
  switch (random.below(4)) {
    case 0:
      return {scene::Sphere{middle, radius}, {}};
    case 1:
      return {scene::Cylinder{middle - frame.u, frame.u, radius, 2, random.below(2) == 0}, {}};
    case 2:
      return {scene::Tube{middle + frame.u, frame.u, radius}, {}};
    default: {
      scene::Group group;  // an ellipsoid
      group.transform = {{normal * radius, frame.u * (2 * radius), frame.v * (0.5 * radius)}, middle};
      group.objects.push_back({scene::Sphere{{0, 0, 0}, 1}, {}});
      return {group, {}};
    }
  }
}

/// Every pixel that shows the plane y = 0, of a scene whose light there nothing hides, is diffuse·|n·l|.
double worst_of_lit_floor(const api::JobRequest& job, const Vec3& lamp) {
  const shading::Scene scene = test::compiled(job.scene);
  const render::Camera camera(job.scene.camera, job.options.width, job.options.height);
  const render::Picture picture = test::render(job);
  double worst = 0;
  for (int row = 0; row < job.options.height; ++row) {
    for (int column = 0; column < job.options.width; ++column) {
      const geometry::Ray ray = camera.ray(column + 0.5, row + 0.5, {0, 0});
      const auto hit = closest_hit(scene.world, ray);
      if (!hit || hit->surface.item != 0 || hit->t > 12) continue;  // beyond, tilted flats meet the floor
      const Vec3 to_lamp = math::normalize(lamp - (ray.origin + ray.direction * hit->t));
      const double seen = picture.film->rgb[picture.film->offset(column, row)];
      worst = std::max(worst, std::fabs(seen - std::min(1.0, diffuse * to_lamp.y)));
    }
  }
  return worst;
}

}  // namespace

TEST_CASE("a hard light on a surface is not hidden by it, from either side") {
  test::Random random(5);
  double worst = 0;
  for (int i = 0; i < 200; ++i) {
    const double far = i % 3 == 0 ? 1000 : 0;
    const Vec3 lamp{far + random.between(-1, 1), random.between(2, 4), far + random.between(-1, 1)};
    api::JobRequest job = looking_at({far + random.between(-3, 3), 2, far + 8}, {far, 0.5, far});
    job.scene.objects.push_back({scene::Plane{{0, 0, 0}, {0, 1, 0}}, {}});
    // Flats that are steep enough to be above the floor near the light, or level; round things that hang it below them.
    const bool is_round = i % 2 == 1;
    const Vec3 down = math::normalize(Vec3{0, -1, 0} + random.in_cube(is_round ? 0 : 0.1));
    job.scene.objects.push_back(is_round ? round_with(lamp, down, random)
                                         : flat_with(lamp, i % 4 < 2 ? down : -down, random));
    // A cylinder whose cap holds the light stands above it.
    if (auto* can = std::get_if<scene::Cylinder>(&job.scene.objects.back().shape); can != nullptr && !is_round)
      can->direction = can->direction.y > 0 ? can->direction : -can->direction;
    job.scene.lights = {scene::PointLight{lamp, math::white, {}, 0}};
    job.options.acceleration = test::accelerations[i % 5];
    const double found = worst_of_lit_floor(job, lamp);
    worst = std::max(worst, found);
    CHECK_MESSAGE(found < 1e-6, "scene ", i);
  }
  MESSAGE("largest difference ", worst);
}

TEST_CASE("glass that stands on a table shows the table") {
  for (const scene::Acceleration acceleration : test::accelerations) {
    api::JobRequest job =
        api::parse_job(R"({"scene":{"camera":{"position":[0.3,3,6],"look_at":[0,0.5,0],"vertical_fov":30},
      "background":[0.9,0.1,0.1],"ambient":0.1,"objects":[
      {"type":"cylinder","point":[-1,0,0],"direction":[0,1,0],"radius":0.5,"height":1,"material":{"diffuse":0.05,"transmission":[0.9,0.9,0.7]}},
      {"type":"mesh","positions":[0.6,0,-0.4, 1.4,0,-0.4, 1.4,0,0.4, 0.6,0,0.4, 0.6,1,-0.4, 1.4,1,-0.4, 1.4,1,0.4, 0.6,1,0.4],
       "indices":[0,1,2,0,2,3,4,6,5,4,7,6,0,4,5,0,5,1,1,5,6,1,6,2,2,6,7,2,7,3,3,7,4,3,4,0],"material":{"diffuse":0.05,"transmission":[0.7,0.9,0.9]}},
      {"type":"polygon","vertices":[[-4,0,-4],[-4,0,4],[4,0,4],[4,0,-4]],"material":{"diffuse":0.7}}],
      "lights":[{"type":"point","position":[2,5,3],"intensity":1,"radius":0.4}]},"options":{"width":150,"height":110}})");
    job.options.acceleration = acceleration;
    const render::Picture picture = test::render(job);
    const render::Camera camera(job.scene.camera, 150, 110);
    int floor = 0, red = 0;
    for (int row = 0; row < 110; ++row) {
      for (int column = 0; column < 150; ++column) {
        // Glass of ior 1 bends nothing: the straight way shows the table.
        const geometry::Ray ray = camera.ray(column + 0.5, row + 0.5, {0, 0});
        const Vec3 p = ray.origin + ray.direction * (-ray.origin.y / ray.direction.y);
        if (!(ray.direction.y < 0 && std::fabs(p.x) < 3.99 && std::fabs(p.z) < 3.99)) continue;
        const float* rgb = &picture.film->rgb[picture.film->offset(column, row)];
        ++floor, red += rgb[0] > 1.05F * rgb[1] ? 1 : 0;
      }
    }
    CHECK(floor > 5000);
    CHECK(red == 0);
  }
}

TEST_CASE("of opaque flats in one plane the first in the scene is met, and any before glass") {
  test::Random random(9);
  for (int i = 0; i < 100; ++i) {
    const Vec3 at = random.in_cube(i % 2 == 0 ? 3 : 1e5), n = random.direction();
    const math::Frame frame = math::frame_around(n);
    const auto p = [&](double x, double y) { return at + frame.u * x + frame.v * y; };
    const auto square = [&](double x, double y, double size, scene::MaterialId material) {
      const double turn = random.between(0, 6.28), c = size * std::cos(turn), s = size * std::sin(turn);
      return scene::Object{scene::Polygon{{p(x + c, y + s), p(x - s, y + c), p(x - c, y - s), p(x + s, y - c)}},
                           material};
    };
    api::JobRequest job = looking_at(p(1, 2) + n * 6, at);
    job.scene.camera.up = frame.u;
    scene::Material glass;
    glass.emission = math::Color{0, 0, 1}, glass.transmission = math::grey(0.5);
    const auto shining = [](double r, double g) {
      scene::Material material;
      material.emission = math::Color{r, g, 0};
      return material;
    };
    job.scene.materials = {glass, shining(1, 0), shining(0, 1)};
    // Glass comes first in the scene, and still the table it lies on is met.
    job.scene.objects = {square(0, 0, 1, scene::MaterialId{0}), square(0.2, 0, 1.5, scene::MaterialId{1}),
                         square(0, 0.3, 4, scene::MaterialId{2})};
    job.options.acceleration = test::accelerations[i % 5];
    const shading::Scene scene = test::compiled(job.scene, job.options.acceleration);
    const render::Camera camera(job.scene.camera, job.options.width, job.options.height);
    const shading::Scene only_first = [&] {
      scene::Description alone = job.scene;
      alone.objects = {job.scene.objects[1]};
      return test::compiled(alone);
    }();
    int wrong = 0, first = 0;
    for (int row = 0; row < job.options.height; ++row) {
      for (int column = 0; column < job.options.width; ++column) {
        const geometry::Ray ray = camera.ray(column + 0.5, row + 0.5, {0, 0});
        const auto hit = closest_hit(scene.world, ray);
        if (!hit) continue;
        const bool is_on_first = closest_hit(only_first.world, ray).has_value();
        first += is_on_first ? 1 : 0;
        const std::uint32_t material = scene.item_material[hit->surface.item];
        wrong += material == (is_on_first ? 1u : 2u) ? 0 : 1;
      }
    }
    CHECK(first > 0);
    CHECK_MESSAGE(wrong == 0, "scene ", i);
  }
}

TEST_CASE("what stands outside a lamp hides nothing from whoever is inside it") {
  const auto picture = [](const std::string& more) {
    const api::JobRequest job = api::parse_job(R"({"scene": {
      "camera": {"position": [0.3, 0.9, 0.4], "look_at": [0.1, 0, 0], "vertical_fov": 40},
      "objects": [{"type": "polygon", "vertices": [[-2, 0, -2], [-2, 0, 2], [2, 0, 2], [2, 0, -2]]})" +
                                               more + R"(],
      "lights": [{"type": "sphere", "center": [0, 0.1, 0], "radius": 1.5, "intensity": 0.2}]},
      "options": {"width": 24, "height": 24, "shadow_samples": 16, "transfer": "linear"}})");
    return test::render(job).film->rgb;
  };
  const auto alone = picture(""),
             roofed = picture(R"(, {"type": "sphere", "center": [0.4, 1.95, 0.1], "radius": 0.3})");
  CHECK(test::rmse(alone, roofed) < 1e-6);
  CHECK(*std::ranges::max_element(alone) > 0.1f);
}
