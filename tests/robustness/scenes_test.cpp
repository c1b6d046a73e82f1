// Recipes 3 and 8: scenes scaled and moved, and meshes as bad as they come.
#include <doctest/doctest.h>

#include "engine/render/camera.h"
#include "tests/robustness/kernels.h"
#include "tests/robustness/worlds.h"
#include "tests/support/picture.h"

using namespace penumbra;
using test::Vec3;

namespace {

/// A ball, a can, a pipe and floors on coordinates that survive scaling by 2^±20 and moving by 10⁶ exactly.
api::JobRequest still_life(double scale, const Vec3& shift) {
  const auto p = [&](double x, double y, double z) { return Vec3{x, y, z} * scale + shift; };
  api::JobRequest job;
  job.scene = test::with_objects({
      {scene::Sphere{p(-1.5, 1, 0), scale}, {}},
      {scene::Cylinder{p(1.5, 0, 0.5), {0, 1, 0}, 0.75 * scale, 1.5 * scale, true}, {}},
      {scene::Tube{p(0, 0.5, -4), {1, 0.125, 0.25}, 0.5 * scale}, {}},
      {scene::Plane{p(0, -1, 0), {0, 1, 0}}, {}},
      {scene::Polygon{{p(-6, 0, 6), p(6, 0, 6), p(6, 0, -6), p(-6, 0, -6)}}, {}},
      {scene::Polygon{{p(-0.5, 0, 2), p(0.5, 0, 2), p(0.5, 1.25, 1.5), p(-0.5, 1.25, 1.5)}}, {}},
  });
  job.scene.camera.position = p(0, 4, 10);
  job.scene.camera.direction = {0, -0.3125, -1};
  job.scene.camera.vertical_fov_degrees = 40;
  job.scene.lights = {scene::PointLight{p(4, 6, 5), math::white, {}, 0.5 * scale}};
  job.options.width = job.options.height = 120;
  return job;
}

std::vector<std::int64_t> ids(const api::JobRequest& job) {
  const shading::Scene scene = test::compiled(job.scene);
  const render::Camera camera(job.scene.camera, job.options.width, job.options.height);
  std::vector<std::int64_t> result;
  for (int row = 0; row < job.options.height; ++row) {
    for (int column = 0; column < job.options.width; ++column) {
      const auto hit = closest_hit(scene.world, camera.ray(column + 0.5, row + 0.5, {0, 0}));
      result.push_back(hit ? hit->surface.item : -1);
    }
  }
  return result;
}

double largest_difference(const render::Film& a, const render::Film& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) largest = std::max<double>(largest, std::fabs(a.rgb[i] - b.rgb[i]));
  return largest;
}

/// Grids, slivers, doubles, points, and a giant beside a dwarf.
std::vector<scene::Object> bad_triangles(test::Random& random) {
  std::vector<scene::Object> objects;
  const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    objects.push_back({scene::Triangle{{a, b, c}}, {}});
  };
  for (int x = -4; x < 4; ++x) {
    for (int z = -4; z < 4; ++z) {
      const Vec3 p{1.0 * x, 0, 1.0 * z};
      add(p, p + Vec3{0, 0, 1}, p + Vec3{1, 0, 0});
      add(p + Vec3{1, 0, 0}, p + Vec3{0, 0, 1}, p + Vec3{1, 0, 1});
    }
  }
  for (int i = 0; i < 20; ++i) {
    const Vec3 p = random.in_cube(3);
    add(p, p + Vec3{1, 0, 0}, p + Vec3{0.5, 1e-6, 0});
    add(p, p, p + Vec3{1, 1, 1});
    add(p, p, p);
  }
  add({-1e9, -2, -1e9}, {0, -2, 1e9}, {1e9, -2, -1e9});
  add({1, 1, 1}, {1.001, 1, 1}, {1, 1.001, 1});
  objects.insert(objects.end(), objects.begin(), objects.begin() + 20);
  return objects;
}

}  // namespace

TEST_CASE("recipe 3: a scaled scene meets the same surfaces; so does a moved one, with the same picture") {
  const auto here = ids(still_life(1, {}));
  // Ten units large, moved by a million times that.
  const Vec3 far{1e7, -0.5e7, 0.75e7};
  for (const std::int64_t instructions : test::kernels()) {
    const test::Kernel kernel(instructions);
    // Down to the least length and up to the largest coordinate that scenes may have.
    for (const int exponent : {-96, -60, -50, -48, -46, -44, -42, -38, -20, 20, 36, 40, 42, 44, 46, 48, 60, 95}) {
      INFO("2^", exponent);
      CHECK(ids(still_life(std::ldexp(1, exponent), {})) == here);
    }
    CHECK(ids(still_life(1, far)) == here);
  }
  const double difference =
      largest_difference(*test::render(still_life(1, {})).film, *test::render(still_life(1, far)).film);
  MESSAGE("largest difference of a picture moved by 10⁶ sizes: ", difference);
  CHECK(difference < 1e-6);
}

TEST_CASE("a scene as small or as large as scenes may be has the picture of the same scene in units of its own") {
  const auto picture = [](int exponent, const scene::Light& light, scene::Acceleration acceleration) {
    api::JobRequest job = still_life(std::ldexp(1, exponent), {});
    job.scene.lights = {light};
    job.options.width = job.options.height = 40;
    job.options.acceleration = acceleration;
    return test::render(job);
  };
  for (const int exponent : {-96, -44, 42, 95}) {
    const double scale = std::ldexp(1, exponent);
    const auto lights = [](double s) {
      return std::vector<scene::Light>{
          scene::PointLight{Vec3{4, 6, 5} * s, math::grey(40), {0, 1 / s, 0.5 / (s * s)}, 0.5 * s},
          scene::SpotLight{Vec3{4, 6, 5} * s, math::white, {}, 0.5 * s, {-4, -6, -5}, 2, 30},
          scene::DirectionalLight{{-4, -6, -5}, math::white, 3},
          scene::RectangleLight{Vec3{3, 6, 4} * s, {2 * s, 0, 0}, {0, 0, 2 * s}, math::grey(20)},
          scene::SphereLight{Vec3{4, 6, 5} * s, 0.5 * s, math::grey(40)}};
    };
    for (std::size_t i = 0; i < lights(1).size(); ++i) {
      for (const auto acceleration : {scene::Acceleration::bvh, scene::Acceleration::median}) {
        INFO("2^", exponent, ", light ", i);
        const auto scaled = picture(exponent, lights(scale)[i], acceleration);
        CHECK(largest_difference(*picture(0, lights(1)[i], acceleration).film, *scaled.film) < 1e-6);
      }
    }
  }
}

#ifdef __FMA__
constexpr bool is_fused = true;
#else
constexpr bool is_fused = false;
#endif

TEST_CASE("far from the origin, where doubles hardly tell thin things, all structures see the same") {
  for (const double far : {1e8, 1e11, 1e12, 1e13}) {
    const auto p = [&](double x, double y, double z) { return Vec3{far + x, far + y, far + z}; };
    std::vector<scene::Object> objects{
        {scene::Polygon{{p(-3, -3, -0.5), p(3, -3, -0.5), p(3, 3, -0.5), p(-3, 3, -0.5)}}, {}}};
    for (const double y : {-0.5, -0.25, 0.0, 0.25, 0.5}) {
      objects.push_back({scene::Triangle{{p(-1, y, 0), p(1, y, 0), p(1, y + 1e-3, 0)}}, {}});
      objects.push_back({scene::Cylinder{p(-1, y + 0.1, 0.1), {1, 0, 0}, 1e-3, 2, true}, {}});
      objects.push_back({scene::Sphere{p(y, y + 0.05, 0.2), 1e-3}, {}});
    }
    for (const double radius : {0.0, 0.05}) {
      api::JobRequest job;
      job.scene = test::with_objects(objects);
      job.scene.background = math::grey(2);
      job.scene.camera.position = p(0, 0, 3), job.scene.camera.direction = {0, 0, -1};
      job.scene.camera.vertical_fov_degrees = 40;
      job.scene.lights = {scene::PointLight{p(0.3, 0.5, 1), math::white, {}, radius}};
      job.options.width = 16, job.options.height = 2001;
      job.options.acceleration = scene::Acceleration::none;
      const auto plain = test::render(job).film->rgb;
      for (const scene::Acceleration acceleration : test::accelerations) {
        job.options.acceleration = acceleration;
        INFO("far ", far, ", radius ", radius, ", acceleration ", static_cast<int>(acceleration));
        const auto seen = test::render(job).film->rgb;
        // Fused, one test of a triangle need not round as another does.
        CHECK((seen == plain || (is_fused && test::rmse(seen, plain) < 1e-6)));
      }
    }
  }
}

TEST_CASE("recipe 8: every structure agrees on grids, slivers, doubles, points, and giants beside dwarfs") {
  test::Random random(8);
  const std::vector<scene::Object> objects = bad_triangles(random);
  const scene::Description description = test::with_objects(objects);
  std::vector<shading::Scene> scenes;
  for (const auto acceleration : test::accelerations) scenes.push_back(test::compiled(description, acceleration));
  int different = 0, hits = 0;
  for (const std::int64_t instructions : test::kernels())
    for (int i = 0; i < test::count(15'000, 1'000'000); ++i) {
      const test::Kernel kernel(instructions);
      // Half of them straight down on the grid's vertices and edges.
      const bool is_straight = i % 2 == 0;
      const Vec3 origin =
          is_straight ? Vec3{0.5 * random.below(16) - 4, 5, 0.5 * random.below(16) - 4} : random.in_cube(8);
      const Vec3 direction = is_straight ? Vec3{0, -1, 0} : random.direction();
      const auto brute = closest_hit(scenes[0].world, {origin, direction, {}});
      if (brute) ++hits;
      for (const shading::Scene& scene : scenes) {
        const auto found = closest_hit(scene.world, {origin, direction, {}});
        if (found.has_value() != brute.has_value() ||
            (found && (found->t != brute->t || found->surface != brute->surface)))
          ++different;
      }
    }
  CHECK(hits > 2000);
  CHECK(different == 0);
}

TEST_CASE("recipe 8: every structure gives the same shadow of a sheared instance under a wide sky") {
  api::JobRequest job = api::parse_job(
      R"({"scene": {"camera": {"position": [-1.201, 2.648, 4.5], "look_at": [0.285, 0.299, 0], "vertical_fov": 50},
    "meshes": {"cube": {"positions": [-0.5,-0.5,-0.5, 0.5,-0.5,-0.5, -0.5,0.5,-0.5, 0.5,0.5,-0.5, -0.5,-0.5,0.5, 0.5,-0.5,0.5, -0.5,0.5,0.5, 0.5,0.5,0.5],
        "indices": [0,2,3, 0,3,1, 4,5,7, 4,7,6, 0,1,5, 0,5,4, 2,6,7, 2,7,3, 0,4,6, 0,6,2, 1,3,7, 1,7,5]},
      "sheet": {"positions": [-1,0,-1, 1,0,-1, 1,0.3,1, -1,0,1], "indices": [0,1,2, 0,2,3]}},
    "objects": [{"type": "group", "transform": [-1.423,0.01,-0.305,0, -0.539,-0.78,0.053,0, -0.739,0.425,-0.164,0, -0.072,1.355,0.97,1], "objects": [
      {"type": "instance", "mesh": "sheet", "transform": [0.714,1.118,0.971,0, -0.78,0.538,0.176,0, 1.017,-0.704,0.329,0, 1.092,1.036,-0.985,1]},
      {"type": "instance", "mesh": "cube", "transform": [0.653,-0.391,0.485,0, -0.321,-0.453,-0.224,0, 0.106,-0.709,-0.611,0, -0.574,1.256,-0.926,1]}]}],
    "lights": [{"type": "directional", "direction": [-0.519, -0.421, -0.879], "angular_radius": 60, "intensity": 1}]},
    "options": {"width": 16, "height": 16, "shadow_samples": 64, "acceleration": "none"}})");
  const render::Film::Values plain = test::render(job).film->rgb;
  for (const auto acceleration : test::accelerations) {
    job.options.acceleration = acceleration;
    CHECK(test::render(job).film->rgb == plain);
  }
}

TEST_CASE("recipe 8: of two equal triangles every structure finds the first, from close by too") {
  test::Random random(8);
  const std::vector<scene::Object> objects = bad_triangles(random);
  // It starts 0.02 above triangles that are 1 large. Their t is rounded as the distance of their vertices is, so it may
  // come out below where the ray enters their flat boxes.
  const geometry::Ray ray{{-0x1.ce191080d7172p+1, 0x1.594b256ea98p-6, -0x1.a58391ead243p+0},
                          {0x1.5c70f0a92bcc7p-1, -0x1.10f53f04f02dap-1, 0x1.01586fcbe4441p-1},
                          {}};
  for (const auto acceleration : test::accelerations) {
    INFO("structure ", static_cast<int>(acceleration));
    const auto hit = closest_hit(test::compiled(test::with_objects(objects), acceleration).world, ray);
    REQUIRE(hit);
    CHECK(hit->surface.item == 4);
  }
}

TEST_CASE("recipe 8: a lit floor of overlapping, doubled and sliver triangles has no speckle") {
  test::Random random(9);
  std::vector<scene::Object> objects;
  for (int i = 0; i < 400; ++i) {
    const Vec3 p{random.between(-5, 5), 0, random.between(-5, 5)};
    const scene::Triangle triangle{
        {p, p + Vec3{0, 0, random.between(0.1, 4)}, p + Vec3{random.between(1e-6, 4), 0, 0}}};
    objects.push_back({triangle, {}});
    if (i % 3 == 0) objects.push_back({triangle, {}});
  }
  objects.push_back({scene::Triangle{{Vec3{-1e9, 0, -1e9}, Vec3{0, 0, 2e9}, Vec3{1e9, 0, -1e9}}}, {}});
  for (const double radius : {0.0, 0.5}) {
    api::JobRequest job;
    job.scene = test::with_objects(objects);
    job.scene.camera = {{0, 3, 8}, {0, -3, -8}, {0, 1, 0}, {}, 50.0, scene::Projection::perspective, {}};
    job.scene.lights = {scene::PointLight{{2, 5, 1}, math::white, {}, radius}};
    job.options.width = job.options.height = 160;
    const render::Film film = *test::render(job).film;
    const render::Camera camera(job.scene.camera, 160, 160);
    int speckles = 0;
    for (int row = 0; row < 160; ++row) {
      for (int column = 0; column < 160; ++column) {
        const geometry::Ray ray = camera.ray(column + 0.5, row + 0.5, {0, 0});
        if (ray.direction.y > -1e-3) continue;
        const Vec3 at = ray.origin + ray.direction * (-ray.origin.y / ray.direction.y);
        const double expected = 0.8 * 5 / math::length(Vec3{2, 5, 1} - at);
        if (std::fabs(film.rgb[film.offset(column, row)] - expected) > 1e-5) ++speckles;
      }
    }
    CHECK(speckles == 0);
  }
}
