// What `target_error` promises: the true error of the picture stays below it, and the estimate tells that error –
// though it is made of samples that were taken until they agreed.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "tests/accuracy/estimate_scenes.h"
#include "tests/support/picture.h"
#include "tests/support/scenes.h"

using namespace penumbra;

namespace {

constexpr const char* ball_through_lens = R"({"scene": {"camera": {"position": [0, 2, 8], "look_at": [0, 1, 0],
    "vertical_fov": 35, "lens": {"aperture_radius": 0.15, "focus_distance": 5}}, "ambient": 0.1, "objects": [
    {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0]}, {"type": "sphere", "center": [0, 1, 0], "radius": 1,
    "material": {"diffuse": [0.8, 0.2, 0.1], "specular": 0.4, "shininess": 60}}],
    "lights": [{"type": "point", "position": [4, 6, 5], "intensity": 1, "radius": 0}]},
    "options": {"width": 48, "height": 36, "samples_per_pixel": 4096, "shadow_samples": 8}})";

/// Bars thinner than a pixel, several to each.
test::NamedJob fence(const std::string& name, double light_radius, bool has_lens, int samples_per_pixel) {
  std::string bars;
  for (int i = 0; i < 40; ++i) {
    const double x = -2 + 0.1 * i;
    bars += fmt::format(R"(, {{"type": "polygon", "vertices": [[{},0,0],[{},0,0],[{},2,0],[{},2,0]]}})", x, x + 0.03,
                        x + 0.13, x + 0.1);
  }
  return {name, api::parse_job(fmt::format(
                    R"({{"scene": {{"background": [0.3, 0.5, 0.8], "ambient": 0.1,
    "camera": {{"position": [0, 2.5, 8], "look_at": [0, 0.8, 0], "vertical_fov": 35{}}},
    "objects": [{{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": {{"diffuse": [0.8, 0.7, 0.6]}}}}{}],
    "lights": [{{"type": "point", "position": [2, 6, {}], "intensity": 1, "radius": {}}}]}},
    "options": {{"width": 44, "height": 36, "samples_per_pixel": {}}}}})",
                    has_lens ? R"(, "lens": {"aperture_radius": 0.2, "focus_distance": 6})" : "", bars,
                    light_radius > 0 ? -4 : 5, light_radius, samples_per_pixel))};
}

std::vector<test::NamedJob> target_scenes() {
  std::vector<test::NamedJob> result{{"ball through a lens", api::parse_job(ball_through_lens)},
                                     fence("fence, hard light", 0, false, 4096),
                                     fence("fence, soft light", 0.5, false, 4096),
                                     fence("fence, soft light, 1 camera ray", 0.5, false, 1),
                                     fence("fence through a lens", 0, true, 4096)};
  for (test::NamedJob& named : test::estimate_scenes()) {
    for (const char* name :
         {"balls, eight soft lights", "balls, rectangle", "mesh, sphere light and rectangle", "coloured panes",
          "glass ball", "mirror", "hard light, 16 camera rays", "soft light, 16 camera rays",
          "rectangle, 16 camera rays", "lens, 16 camera rays", "hard-and-soft, 4 camera rays", "room-flat"}) {
      if (named.name == name) result.push_back(std::move(named));
    }
  }
  return result;
}

/// Of fixed numbers of samples.
test::Reference truth_of(api::JobRequest job) {
  scene::Options& options = job.options;
  options.target_error.reset();
  const bool has_several = options.samples_per_pixel > 1;
  options.samples_per_pixel = has_several ? 1024 : 1, options.shadow_samples = has_several ? 8 : 4096;
  return test::reference_of(job);
}

}  // namespace

TEST_CASE("with a target the true error stays below it, and the estimate tells it") {
  std::vector<test::NamedJob> scenes = target_scenes();
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  scenes.resize(2);
#endif
  for (test::NamedJob& named : scenes) {
    const test::Reference truth = truth_of(named.job);
    scene::Options& options = named.job.options;
    if (options.samples_per_pixel > 1) options.samples_per_pixel = 4096;
    options.shadow_samples = 1024;
    for (const double target : {1e-2, 3e-3, 1e-3}) {
      options.target_error = target;
      const render::Picture picture = test::render(named.job);
      const double difference = test::rmse(picture.film->rgb, truth.mean), estimate = picture.stats.estimated_error;
      const double error = std::sqrt(std::max(0.0, difference * difference - truth.squared_noise));
      INFO(
          fmt::format("{}, target {}: RMSE {:.2e} ({:.2f} of the target), the reference's {:.0e}, estimated {:.2e} "
                      "({:.2f} of the RMSE), {} rays",
                      named.name, target, error, error / target, std::sqrt(truth.squared_noise), estimate,
                      estimate / error, picture.stats.rays.camera + picture.stats.rays.shadow));
      CHECK(error <= 1.1 * target);
      CHECK(estimate >= 0.5 * error);
      CHECK(estimate <= 2 * error);
    }
  }
}

TEST_CASE("the target is the picture's: no pixel is told better than the whole asks for") {
  for (const char* name : {"cow", "thousand-spheres"}) {
    api::JobRequest job = test::example(name);
    job.options.width = 240, job.options.height = 180, job.options.samples_per_pixel = 1;
    job.scene.lights = {scene::PointLight{{6, 12, 8}, math::grey(0.9), {}, 2.5}};
    const test::Reference truth = truth_of(job);
    job.options.shadow_samples = 4096;
    for (const double target : {1e-2, 3e-3}) {
      job.options.target_error = target;
      const render::Picture picture = test::render(job);
      const double error = test::rmse(picture.film->rgb, truth.mean), estimate = picture.stats.estimated_error;
      MESSAGE(fmt::format("{}, target {}: RMSE {:.2f} of the target, estimated {:.2f} of the RMSE", name, target,
                          error / target, estimate / error));
      CHECK(error <= 1.1 * target);
      CHECK(error >= 0.3 * target);
      CHECK(estimate >= 0.5 * error);
      CHECK(estimate <= 2 * error);
    }
  }
}

TEST_CASE("with a target every acceleration gives the same picture of area lights on shiny surfaces") {
  for (test::NamedJob& named : test::estimate_scenes()) {
    if (named.name != "balls, rectangle" && named.name != "mesh, sphere light and rectangle") continue;
    named.job.options.target_error = 3e-3, named.job.options.shadow_samples = 256;
    named.job.options.acceleration = scene::Acceleration::bvh;
    const auto first = test::render(named.job).film;
    for (const auto other : {scene::Acceleration::median, scene::Acceleration::cbr, scene::Acceleration::none}) {
      named.job.options.acceleration = other;
      INFO(named.name);
      CHECK(test::render(named.job).film->rgb == first->rgb);
    }
  }
}
