// The structure that finds surfaces changes no picture.
#include <doctest/doctest.h>

#include "tests/robustness/worlds.h"
#include "tests/support/picture.h"

using namespace penumbra;
using test::Vec3;

namespace {

scene::Shape random_shape(test::Random& random) {
  const Vec3 at = random.in_cube(1.5) + Vec3{0, 0.8, 0};
  const double size = random.between(0.1, 0.9);
  switch (random.below(7)) {
    case 0:
      return scene::Sphere{at, size};
    case 1:
      return scene::Cylinder{at, random.direction(), size * 0.5, size * 2, random.below(3) > 0};
    case 2:
      return scene::Tube{at, random.direction(), size * 0.2};
    case 3:
      return scene::Triangle{{at, at + random.in_cube(2 * size), at + random.in_cube(2 * size)}};
    case 4:
      return scene::Plane{{0, random.between(-1, 0), 0}, Vec3{0, 1, 0} + random.in_cube(0.2)};
    case 5: {
      const Vec3 u = random.direction() * size, v = math::cross(u, random.direction());
      return scene::Polygon{{at - u - v, at + u - v, at + u * 1.5, at + u + v, at - u + v}};
    }
    default: {
      scene::Mesh box;
      for (int i = 0; i < 8; ++i) box.positions.push_back(at + Vec3{i % 2 * size, i / 2 % 2 * size, i / 4 * size});
      box.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                       {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
      return box;
    }
  }
}

/// Opaque things, some turned and sheared, on a floor; soft lights around and between them, many of whose discs dip
/// below a surface.
api::JobRequest random_job(test::Random& random) {
  std::vector<scene::Object> objects{{scene::Plane{{0, 0, 0}, {random.between(-0.1, 0.1), 1, 0.05}}, {}}};
  const auto count = 2 + random.below(8);
  for (int i = 0; i < count; ++i) objects.push_back({random_shape(random), {}});
  scene::Group group;
  group.transform = {{Vec3{1, 0.2, 0}, random.direction(), random.direction()}, random.in_cube(1)};
  if (std::fabs(group.transform.determinant()) > 0.1) {
    for (int i = random.below(4); i > 0; --i) group.objects.push_back({random_shape(random), {}});
    objects.push_back({group, {}});
  }
  api::JobRequest job;
  job.scene = test::with_objects(std::move(objects));
  job.scene.background = math::grey(0.3), job.scene.ambient = math::grey(0.05);
  job.scene.camera.position = {random.between(-4, 4), random.between(0.3, 4), 6};
  job.scene.camera.direction = Vec3{0, 0.7, 0} - job.scene.camera.position;
  job.scene.camera.vertical_fov_degrees = 45;
  for (int i = 1 + random.below(3); i > 0; --i) {
    const Vec3 at = random.in_cube(2) + Vec3{0, 1.2, 0};
    if (random.below(5) == 0) {
      job.scene.lights.push_back(scene::DirectionalLight{-at - Vec3{0, 1, 0}, math::grey(0.5), random.between(0, 20)});
    } else {
      job.scene.lights.push_back(scene::PointLight{at, math::grey(0.5), {}, random.between(0.01, 1.5)});
    }
  }
  job.options.width = 24, job.options.height = 18;
  job.options.shadow_samples = 1 << random.below(8);
  job.options.max_depth = 0;
  return job;
}

}  // namespace

TEST_CASE("five accelerations, one picture") {
  test::Random random(41);
  int different = 0;
  for (int i = 0; i < test::count(500, 5000); ++i) {
    api::JobRequest job = random_job(random);
    std::vector<float> first;
    for (const scene::Acceleration acceleration : test::accelerations) {
      job.options.acceleration = acceleration;
      const render::Picture picture = test::render(job);
      const std::vector<float> values(picture.film->rgb.begin(), picture.film->rgb.end());
      if (first.empty()) first = values;
      different += values == first ? 0 : 1;
      CHECK_MESSAGE(values == first, "scene ", i, ", acceleration ", static_cast<int>(acceleration));
    }
  }
  CHECK(different == 0);
}
