// Soft shadows where geometry is hostile: far from the origin, at grazing light, with lights and cameras inside of
// things or touching them, with tiny and huge lights.
#include <doctest/doctest.h>

#include <optional>

#include "engine/render/camera.h"
#include "tests/robustness/worlds.h"
#include "tests/support/picture.h"

using namespace penumbra;
using test::Vec3;

namespace {

constexpr double offsets[]{0, 1e4, 1e6, 1e8};
const Vec3 away{0.61, -0.37, 0.83};

scene::Mesh box(const Vec3& low, const Vec3& high) {
  scene::Mesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.push_back(
        {(i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y, (i & 4) != 0 ? high.z : low.z});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// Looking from `eye` at `center`.
api::JobRequest job_of(std::vector<scene::Object> objects, std::vector<scene::Light> lights, const Vec3& eye,
                       const Vec3& center, double fov = 60) {
  api::JobRequest job;
  job.scene = test::with_objects(std::move(objects));
  job.scene.lights = std::move(lights);
  job.scene.camera.position = eye;
  job.scene.camera.direction = center - eye;
  job.scene.camera.vertical_fov_degrees = fov;
  job.options.width = job.options.height = test::count(40, 200);
  job.options.shadow_samples = 64;
  return job;
}

scene::PointLight soft_light(const Vec3& position, double radius) { return {position, math::white, {}, radius}; }

/// The light on a lonely convex surface: all of it where the whole disc is above the horizon, nothing where all of it
/// is below; unknown in between.
std::optional<double> expected(const geometry::SurfacePoint& at, const Vec3& facing, const scene::PointLight& light) {
  const Vec3 towards = light.position - at.position;
  const double distance = math::length(towards), height = math::dot(facing, towards);
  const double cosine = height / distance;
  const double reach = light.radius * std::sqrt(std::max(0.0, 1 - cosine * cosine));
  if (height > reach + 1e-6) return 0.8 * cosine;
  if (height < 0) return 0;
  return std::nullopt;
}

int wrong_pixels(const api::JobRequest& job, const scene::PointLight& light, double tolerance, bool use_candidates) {
  const render::Film film = *test::render(job, test::with_candidates(use_candidates)).film;
  const shading::Scene scene = test::compiled(job.scene);
  const render::Camera camera(job.scene.camera, film.width, film.height);
  int wrong = 0;
  for (int row = 0; row < film.height; ++row) {
    for (int column = 0; column < film.width; ++column) {
      const geometry::Ray ray = camera.ray(column + 0.5, row + 0.5, {0, 0});
      const auto hit = closest_hit(scene.world, ray);
      if (!hit) continue;
      const geometry::SurfacePoint at = surface_at(scene.world, ray, *hit);
      const Vec3 facing = math::dot(at.normal, ray.direction) > 0 ? -at.normal : at.normal;
      const std::optional<double> value = expected(at, facing, light);
      if (value && !(std::fabs(film.rgb[film.offset(column, row)] - *value) <= tolerance)) ++wrong;
    }
  }
  return wrong;
}

bool is_finite(const render::Film& film) {
  return std::all_of(film.rgb.begin(), film.rgb.end(), [](float v) { return std::isfinite(v); });
}

/// One query of the light's cone and single rays find the same light, to within what either may be off.
void check_agreement(const char* what, api::JobRequest job) {
  INFO(what);
  job.options.shadow_samples = 256;
  const render::Picture listed = test::render(job, test::with_candidates(true)),
                        rays = test::render(job, test::with_candidates(false));
  CHECK(is_finite(*listed.film));
  CHECK(is_finite(*rays.film));
  const double difference = test::rmse(listed.film->rgb, rays.film->rgb);
  CHECK(difference <= 3 * std::hypot(listed.stats.estimated_error, rays.stats.estimated_error) + 1e-6);
}

scene::Material glass(double ior, double transmission) {
  scene::Material material;
  material.diffuse = math::grey(0.1);
  material.transmission = {transmission, 0.9 * transmission, 0.8 * transmission};
  material.ior = ior;
  return material;
}

}  // namespace

TEST_CASE("no acne: a lonely convex shape is lit wholly wherever the light is above its horizon, near and far") {
  for (const double offset : offsets) {
    const Vec3 c = away * offset;
    const std::vector<std::pair<const char*, scene::Shape>> shapes{
        {"sphere", scene::Sphere{c, 1}},
        {"plane", scene::Plane{c, {0.2, 1, 0.1}}},
        {"tube", scene::Tube{c, {1, 0.3, 0.2}, 1}},
        {"cylinder", scene::Cylinder{c, {0.3, 1, 0.2}, 0.8, 1.2, true}},
        {"box", box(c - Vec3{1, 1, 1}, c + Vec3{1, 1, 1})},
        {"triangle", scene::Triangle{{c + Vec3{-2, 0, 2}, c + Vec3{2, 0.5, 2}, c + Vec3{0, 0, -2}}}}};
    for (const auto& [name, shape] : shapes) {
      for (const double radius : {1e-6, 0.4, 2.0}) {
        const scene::PointLight light = soft_light(c + Vec3{2, 4, 3}, radius);
        const api::JobRequest job = job_of({{shape, {}}}, {light}, c + Vec3{1, 3, 5}, c);
        for (const bool use_candidates : {true, false}) {
          INFO(name, ", offset ", offset, ", light of radius ", radius, ", candidates ", use_candidates);
          // Positions are rounded by a few units of the last place of the offset.
          CHECK(wrong_pixels(job, light, 1e-6 + 1e-15 * offset, use_candidates) == 0);
        }
      }
    }
  }
}

TEST_CASE("no leaks: a ball in a closed room sees no light from outside, near and far") {
  for (const double offset : offsets) {
    const Vec3 c = away * offset;
    std::vector<scene::Object> planes;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {-2.0, 2.0}) {
        Vec3 normal;
        normal[axis] = side;
        planes.push_back({scene::Plane{c + normal, normal}, {}});
      }
    }
    const std::vector<std::pair<const char*, std::vector<scene::Object>>> rooms{
        {"sphere", {{scene::Sphere{c, 2.5}, {}}}},
        {"cylinder", {{scene::Cylinder{c - Vec3{0.5, 2, 0}, {0.25, 1, 0}, 2, 4, true}, {}}}},
        {"box", {{box(c - Vec3{2, 2, 2}, c + Vec3{2, 2, 2}), {}}}},
        {"planes", planes}};
    const std::vector<scene::Light> lights{
        soft_light(c + Vec3{2, 9, 3}, 0.5), soft_light(c + Vec3{-9, 2, 3}, 4),
        scene::DirectionalLight{{1, -1, 0.3}, math::white, 20},
        scene::RectangleLight{c + Vec3{-3, 6, -3}, {6, 0, 0}, {0, 0, 6}, math::white},
        scene::SphereLight{c + Vec3{7, 3, 7}, 3, math::white}};
    for (const auto& [name, room] : rooms) {
      std::vector<scene::Object> objects = room;
      objects.push_back({scene::Sphere{c, 0.7}, {}});
      const api::JobRequest job = job_of(objects, lights, c + Vec3{0.4, 0.8, 1.2}, c, 100);
      for (const bool use_candidates : {true, false}) {
        INFO(name, ", offset ", offset, ", candidates ", use_candidates);
        const render::Film film = *test::render(job, test::with_candidates(use_candidates)).film;
        // Where outlines of a wall's triangles meet, shares of the light may round.
        CHECK(*std::max_element(film.rgb.begin(), film.rgb.end()) < 1e-14);
      }
    }
  }
}

TEST_CASE("a light inside a ball stays there, and lights all of its inside") {
  for (const double offset : offsets) {
    const Vec3 c = away * offset;
    const scene::PointLight light = soft_light(c + Vec3{0.3, 0.2, 0}, 0.3);
    const scene::Object ball{scene::Sphere{c, 1}, {}}, floor{scene::Plane{c - Vec3{0, 1.5, 0}, {0, 1, 0}}, {}};
    for (const bool use_candidates : {true, false}) {
      INFO("offset ", offset, ", candidates ", use_candidates);
      const render::Film outside =
          *test::render(job_of({ball, floor}, {light}, c + Vec3{0, 1, 5}, c), test::with_candidates(use_candidates))
               .film;
      CHECK(*std::max_element(outside.rgb.begin(), outside.rgb.end()) == 0);
      const api::JobRequest inside = job_of({ball}, {light}, c + Vec3{-0.2, 0.1, 0.5}, c, 120);
      CHECK(wrong_pixels(inside, light, 1e-6 + 1e-15 * offset, use_candidates) == 0);
    }
  }
}

TEST_CASE("lights that graze, touch and cut surfaces, tiny and huge ones: cones and rays agree") {
  const scene::Object floor{scene::Plane{{0, 0, 0}, {0, 1, 0}}, {}}, ball{scene::Sphere{{-1, 0.8, 0}, 0.8}, {}},
      crate{box({0.6, 0, -0.5}, {1.4, 1, 0.5}), {}}, can{scene::Cylinder{{0, 0, 1.5}, {0, 1, 0}, 0.3, 0.7, true}, {}};
  const std::vector<scene::Object> all{floor, ball, crate, can};
  const Vec3 eye{0, 3, 6}, center{0, 0.5, 0};
  const auto check = [&](const char* what, const scene::Light& light) {
    check_agreement(what, job_of(all, {light}, eye, center));
  };
  check("just above the floor", soft_light({6, 0.01, 1}, 0.5));
  check("its center in the floor", soft_light({4, 0, 1}, 0.5));
  check("below the floor, reaching above it", soft_light({4, -0.2, 1}, 0.5));
  check("touching the ball", soft_light({-1, 1.6, 0}, 0.4));
  check("its center on the crate", soft_light({1, 1, 0}, 0.3));
  check("inside the crate, larger than it", soft_light({1, 0.5, 0}, 2));
  check("around the ball", soft_light({-1, 0.8, 0}, 3));
  check("huge", soft_light({0, 10, 0}, 1e6));
  check("a sky", scene::DirectionalLight{{0.1, -1, 0.2}, math::white, 89});
  check("a sun at the horizon", scene::DirectionalLight{{1, -0.001, 0.2}, math::white, 1});
  check("a spot cut by the floor", scene::SpotLight{{3, 0.1, 2}, math::white, {}, 0.5, {-1, -0.02, -0.5}, 1, 40});
  check("a sphere light on the floor", scene::SphereLight{{2.5, 0.5, 1}, 0.5, math::grey(3)});
  check("a sphere light around the crate", scene::SphereLight{{1, 0.5, 0}, 1.5, math::grey(1)});
  check("a sphere light around everything", scene::SphereLight{{0, 0, 0}, 50, math::grey(0.5)});
  check("a rectangle on the floor's edge", scene::RectangleLight{{3, 0, -2}, {0, 0, 4}, {0, 2, 0}, math::grey(2)});
  check("a rectangle cutting the crate", scene::RectangleLight{{0, 0.5, -1}, {0, 0, 2}, {2, 0, 0}, math::grey(2)});
  check("a sliver of a rectangle", scene::RectangleLight{{-3, 4, 0}, {6, 0, 0}, {0, 0, 1e-7}, math::grey(1e6)});
}

TEST_CASE("the tiniest soft light is a hard one") {
  const std::vector<scene::Object> objects{{scene::Plane{{0, 0, 0}, {0, 1, 0}}, {}},
                                           {scene::Sphere{{-1, 0.8, 0}, 0.8}, {}},
                                           {box({0.6, 0, -0.5}, {1.4, 1, 0.5}), {}}};
  const Vec3 eye{0, 3, 6};
  for (const Vec3& position : {Vec3{3, 5, 3}, Vec3{-4, 0.7, 2}}) {
    const render::Film hard = *test::render(job_of(objects, {soft_light(position, 0)}, eye, {})).film;
    for (const double radius : {1e-12, 1e-9}) {
      for (const bool use_candidates : {true, false}) {
        const render::Film soft = *test::render(job_of(objects, {soft_light(position, radius)}, eye, {}),
                                                test::with_candidates(use_candidates))
                                       .film;
        INFO("radius ", radius, ", candidates ", use_candidates);
        CHECK(test::rmse(soft.rgb, hard.rgb) < 1e-6);
      }
    }
  }
}

TEST_CASE("cameras inside of glass, glass inside of glass: cones and rays agree") {
  const Vec3 eye{0, 1, 6};
  api::JobRequest job = job_of({{scene::Plane{{0, -1, 0}, {0, 1, 0}}, {}},
                                {scene::Sphere{{0, 0, 0}, 1}, scene::MaterialId{1}},
                                {scene::Sphere{{0, 0, 0}, 0.7}, scene::MaterialId{2}},
                                {scene::Sphere{{0, 0, 0}, 0.4}, scene::MaterialId{1}},
                                {scene::Sphere{{0, 0, 0}, 0.2}, {}},
                                {box({1, -1, -1}, {2, 0, 0}), scene::MaterialId{2}},
                                {box({1.2, -0.8, -0.8}, {1.8, -0.2, -0.2}), {}}},
                               {soft_light({2, 4, 2}, 0.5)}, eye, {});
  job.scene.materials.push_back(glass(1.5, 0.9));
  job.scene.materials.push_back(glass(1, 0.7));
  check_agreement("from outside", job);
  for (const Vec3& inside : {Vec3{0, 0, 0.85}, Vec3{0, 0.1, 0.55}, Vec3{0, 0, 0.3}, Vec3{1.5, -0.1, -0.1}}) {
    job.scene.camera.position = inside;
    job.scene.camera.direction = Vec3{0.1, -0.2, -1};
    check_agreement("from inside", job);
  }
}

TEST_CASE("triangles without an area change nothing") {
  std::vector<scene::Object> objects{{scene::Plane{{0, 0, 0}, {0, 1, 0}}, {}},
                                     {box({-0.5, 0, -0.5}, {0.5, 1, 0.5}), {}}};
  const auto picture = [&](bool use_candidates) {
    return test::render(job_of(objects, {soft_light({3, 5, 3}, 0.7)}, {0, 3, 6}, {}),
                        test::with_candidates(use_candidates))
        .film->rgb;
  };
  const render::Film::Values listed = picture(true), rays = picture(false);
  test::Random random(3);
  for (int i = 0; i < 50; ++i) {
    const Vec3 p = random.in_cube(2), q = random.in_cube(2);
    objects.push_back({scene::Triangle{{p, p, p}}, {}});
    objects.push_back({scene::Triangle{{p, q, p}}, {}});
    objects.push_back({scene::Triangle{{p, p + Vec3{1, 0, 0}, p + Vec3{0.5, 0, 0}}}, {}});
  }
  CHECK(test::rmse(picture(true), listed) < 1e-3);
  CHECK(test::rmse(picture(false), rays) < 1e-6);
}
