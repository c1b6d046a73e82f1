// Many lights: what is skipped of them changes no pixel where no error is asked for, and else stays within it.
#include <doctest/doctest.h>

#include "engine/render/refine.h"
#include "tests/robustness/worlds.h"
#include "tests/support/picture.h"
#include "tests/support/scenes.h"

using namespace penumbra;

namespace {

scene::Light random_light(test::Random& random, double radius) {
  const math::Vec3 position{random.between(-6, 6), random.between(-0.5, 4), random.between(-6, 6)};
  const math::Color intensity = math::grey(random.between(0, 0.2));
  const scene::Attenuation attenuation{1, 0, random.below(2) * random.between(0.1, 4)};
  switch (random.below(7)) {
    case 0:
      return scene::DirectionalLight{random.direction(), intensity * 0.1, radius > 0 ? 2.0 : 0};
    case 1:
      if (radius > 0) return scene::RectangleLight{position, {0.4, 0, 0}, {0, 0, 0.3}, intensity};
      [[fallthrough]];
    case 2:
      if (radius > 0) return scene::SphereLight{position, 0.2, intensity};
      [[fallthrough]];
    case 3:
      return scene::PointLight{position, intensity, attenuation, radius};
    default:
      return scene::SpotLight{position,
                              intensity,
                              attenuation,
                              random.below(2) * radius,
                              random.direction(),
                              random.below(3) * 1.0,
                              random.between(5, 100)};
  }
}

api::JobRequest lit_by_many(test::Random& random, int lights, double radius) {
  api::JobRequest job = test::zoo();
  job.options.width = 40, job.options.height = 30, job.options.shadow_samples = 2;
  job.scene.lights.clear();
  for (int k = 0; k < lights; ++k) job.scene.lights.push_back(random_light(random, radius));
  return job;
}

constexpr auto without(bool shading::Switches::*part) {
  render::Switches switches;
  switches.*part = false;
  return switches;
}
const render::Switches plain = without(&shading::Switches::light_tree);

}  // namespace

TEST_CASE("lights that are skipped together change no pixel") {
  test::Random random(91);
  for (const double radius : {0.0, 0.2}) {
    for (int i = 0; i < 4; ++i) {
      api::JobRequest job = lit_by_many(random, 200, radius);
      if (i == 3) job.options.samples_per_pixel = 3;
      const render::Picture on = test::render(job), off = test::render(job, plain);
      CHECK(on.film->rgb == off.film->rgb);
      CHECK(on.stats.estimated_error == off.stats.estimated_error);
      CHECK(on.stats.rays.shadow == off.stats.rays.shadow);
      CHECK(on.stats.skipped.at("lights_culled") > 60'000);
      CHECK(off.stats.skipped.at("lights_culled") == 0);
      CHECK(on.stats.skipped.at("lights_from_drawn") == 0);
    }
  }
}

TEST_CASE("a few lights are looked at one after the other") {
  test::Random random(92);
  CHECK(test::render(lit_by_many(random, 8, 0)).stats.skipped.at("lights_culled") == 0);
  CHECK(test::render(lit_by_many(random, 9, 0)).stats.skipped.at("lights_culled") > 0);
}

TEST_CASE("with an error asked for, lights that stand for others make no more than their share of it, and tell it") {
  test::Random random(93);
  for (const double target : {0.003, 0.03, 0.3}) {
    for (const double exposure : {0.0, 1.0}) {
      for (const int samples : {1, 3}) {
        api::JobRequest job = lit_by_many(random, 200, 0);  // without soft shadows everything else is exact
        job.options.exposure = exposure, job.options.samples_per_pixel = samples;
        const render::Picture exact = test::render(job);
        job.options.target_error = target;
        const render::Picture drawn = test::render(job);
        const render::Picture each = test::render(job, without(&shading::Switches::drawn_lights));
        CHECK(drawn.stats.skipped.at("lights_from_drawn") > 0);
        CHECK(each.stats.skipped.at("lights_from_drawn") == 0);
        CHECK(exact.stats.skipped.at("lights_from_drawn") == 0);
        const double error = test::rmse(drawn.film->rgb, each.film->rgb);
        CHECK(error > 0);
        CHECK(error <= render::light_error_share * target);
        if (samples > 1) continue;  // of which the estimate tells more
        CHECK(each.film->rgb == exact.film->rgb);
        CHECK(error <= 1.5 * drawn.stats.estimated_error);
        CHECK(error >= 0.2 * drawn.stats.estimated_error);
      }
    }
  }
}

TEST_CASE("which lights stand for others depends on no thread and no structure") {
  test::Random random(95);
  api::JobRequest job = lit_by_many(random, 100, 0.2);
  for (scene::Material& material : job.scene.materials) material.transmission = math::black;  // whose products round
  for (const std::optional<double> target : {std::optional<double>{}, std::optional(0.02)}) {
    job.options.target_error = target, job.options.threads = scene::serial;
    job.options.acceleration = scene::Acceleration::bvh;
    const render::Picture one = test::render(job);
    CHECK((one.stats.skipped.at("lights_from_drawn") > 0) == target.has_value());
    job.options.threads = 2;
    const render::Picture two = test::render(job);
    CHECK(one.film->rgb == two.film->rgb);
    CHECK(one.stats.skipped == two.stats.skipped);
    job.options.acceleration = scene::Acceleration::median;
    CHECK(one.film->rgb == test::render(job).film->rgb);
  }
}

TEST_CASE("of a thousand lights that fall off, few are looked at for a point") {
  test::Random random(94);
  api::JobRequest job =
      api::parse_job(R"({"scene": {"camera": {"position": [0, 9, 24], "look_at": [0, 0, 3], "vertical_fov": 50},
    "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0]}, {"type": "sphere", "center": [0, 1, 5], "radius": 1}]},
    "options": {"width": 40, "height": 40, "shadow_samples": 2}})");
  for (int k = 0; k < 1000; ++k) {
    const math::Vec3 position{random.between(-20, 20), random.between(0.5, 1), random.between(-20, 20)};
    const scene::SpotLight light{position, math::grey(1), {1, 0, 4}, 0.1, {random.between(-0.3, 0.3), -1, 0}, 1, 70};
    job.scene.lights.emplace_back(light);
  }
  const double pixels = 40.0 * 40;
  const auto skipped = [&](const char* what) {
    return static_cast<double>(test::render(job).stats.skipped.at(what)) / pixels;
  };
  CHECK(skipped("lights_culled") > 600);
  job.options.target_error = 0.02;
  CHECK(skipped("lights_culled") + skipped("lights_from_drawn") > 900);
}
