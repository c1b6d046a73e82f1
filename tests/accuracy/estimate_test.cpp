// The estimate of an image's own error, against its true error: the difference from a picture of many more samples.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "tests/accuracy/estimate_scenes.h"
#include "tests/accuracy/oracle.h"
#include "tests/support/picture.h"
#include "tests/support/scenes.h"

using namespace penumbra;

namespace {

/// All scenes, or every fifth where a sanitizer slows each down.
std::vector<test::NamedJob> scenes() {
  std::vector<test::NamedJob> all = test::estimate_scenes();
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  std::vector<test::NamedJob> some;
  for (std::size_t i = 0; i < all.size(); i += 5) some.push_back(std::move(all[i]));
  return some;
#else
  return all;
#endif
}

void make_soft(scene::Description& scene, double radius) {
  for (scene::Light& light : scene.lights) {
    if (auto* point = std::get_if<scene::PointLight>(&light)) point->radius = radius;
    if (auto* spot = std::get_if<scene::SpotLight>(&light)) spot->radius = radius;
  }
}

/// Of many samples.
test::Reference truth_of(api::JobRequest job) {
  scene::Options& options = job.options;
  options.target_error.reset();
  options.shadow_samples = 1024;
  if (options.samples_per_pixel > 1 || job.scene.camera.lens) {
    options.samples_per_pixel = std::max(16 * options.samples_per_pixel, 256);
    options.shadow_samples = 64;
  }
  return test::reference_of(job);
}

}  // namespace

TEST_CASE("the estimated error is within a factor of two of the true one") {
  for (test::NamedJob& named : scenes()) {
    const test::Reference reference = truth_of(named.job);
    for (const int samples : {1, 4, 16, 64, 256}) {
      named.job.options.shadow_samples = samples;
      const render::Picture picture = test::render(named.job);
      const double difference = test::rmse(picture.film->rgb, reference.mean), estimate = picture.stats.estimated_error;
      const double error = std::sqrt(std::max(0.0, difference * difference - reference.squared_noise));
      INFO(fmt::format(
          "{}, {} shadow samples: RMSE {:.2e} of which the reference's {:.0e}, estimated {:.2e}, ratio {:.2f}",
          named.name, samples, error, std::sqrt(reference.squared_noise), estimate,
          estimate > 0 ? error / estimate : 1));
      CHECK(error >= 0.5 * estimate);
      CHECK(error <= 2 * estimate);
    }
  }
}

TEST_CASE("with a target the error of the picture stays below it, and looser targets cost less") {
  for (test::NamedJob& named : scenes()) {
    const test::Reference reference = truth_of(named.job);
    scene::Options& options = named.job.options;
    options.shadow_samples = 256;
    // Where camera rays are spread their cap must not be what ends the refinement.
    if (options.samples_per_pixel > 1) options.samples_per_pixel = 1024;
    std::uint64_t rays = 0;
    double estimate = 1;
    for (const double target : {0.03, 0.01}) {
      options.target_error = target;
      const render::Picture picture = test::render(named.job);
      const double error = test::rmse(picture.film->rgb, reference.mean);
      INFO(fmt::format("{}, target {}: RMSE {:.2e}, estimated {:.2e}", named.name, target, error,
                       picture.stats.estimated_error));
      // A lens of one ray is noisy whatever the lights do.
      if (named.job.scene.camera.lens && options.samples_per_pixel == 1) continue;
      CHECK(error <= target);
      // Of one camera ray, many samples may take fewer rays than few do: outlines take their place.
      const std::uint64_t cost = picture.stats.rays.camera + picture.stats.rays.shadow;
      if (options.samples_per_pixel > 1) CHECK(cost >= rays);
      CHECK(picture.stats.estimated_error <= estimate);
      rays = cost, estimate = picture.stats.estimated_error;
    }
  }
}

TEST_CASE("with a target an outline that few samples see is refined") {
  api::JobRequest job = api::parse_job(
      R"({"scene": {"camera": {"position": [0, 0, 5], "look_at": [0, 0, 0], "vertical_fov": 50}, "background": 0,
    "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1.5, "material": {"emission": 0.9}}]},
    "options": {"width": 64, "height": 64, "samples_per_pixel": 4096}})");
  const auto truth = test::render(job).film;
  for (const double target : {0.01, 0.003, 0.001}) {
    job.options.target_error = target;
    const render::Picture picture = test::render(job);
    const double error = test::rmse(picture.film->rgb, truth->rgb);
    INFO(fmt::format("target {}: RMSE {:.2e}, estimated {:.2e}, {} camera rays", target, error,
                     picture.stats.estimated_error, picture.stats.rays.camera));
    CHECK(error <= target);
    CHECK(picture.stats.rays.camera < 64 * 64 * 4096 / 4);
  }
}

TEST_CASE("with a target out of reach the picture is as good as the caps allow") {
  for (test::NamedJob& named : scenes()) {
    named.job.options.shadow_samples = 16;
    const test::Reference reference = truth_of(named.job);
    const double capped = test::rmse(test::render(named.job).film->rgb, reference.mean);
    named.job.options.target_error = 1e-9;
    INFO(named.name);
    CHECK(test::rmse(test::render(named.job).film->rgb, reference.mean) <= 1.05 * capped);
  }
}

TEST_CASE("the estimated error is within a factor of two of the distance from brute force") {
  constexpr int size = 32;
  for (const auto& [name, radius] : {std::pair{"room-flat", 0.0},
                                     {"shadow-triangles-sphere", 10},
                                     {"shadow-sphere-triangle", 20},
                                     {"transmission-two-spheres", 20}}) {
    api::JobRequest job = test::predecessor(name);
    if (radius > 0) make_soft(job.scene, radius);
    job.options.width = job.options.height = size;
    job.options.shadow_samples = 4;
    const render::Picture picture = test::render(job);
    // Two halves, whose difference is twice the noise of their mean.
    test::Oracle first(job.scene, job.options, 512, 1), second(job.scene, job.options, 512, 2);
    double squares = 0, noise = 0;
    for (int row = 0; row < size; ++row) {
      for (int column = 0; column < size; ++column) {
        const auto a = first.pixel(column, row), b = second.pixel(column, row);
        for (std::size_t c = 0; c < 3; ++c) {
          const double x = std::clamp(a[c], 0.0, 1.0), y = std::clamp(b[c], 0.0, 1.0);
          const double d =
              std::clamp<double>(picture.film->rgb[picture.film->offset(column, row) + c], 0, 1) - (x + y) / 2;
          squares += d * d, noise += (x - y) * (x - y) / 4;
        }
      }
    }
    const double channels = 3.0 * size * size, error = std::sqrt((squares - noise) / channels);
    const double estimate = picture.stats.estimated_error;
    MESSAGE(fmt::format("{}: RMSE {:.2e}, the oracle's {:.0e}, estimated {:.2e}", name, error,
                        std::sqrt(noise / channels), estimate));
    CHECK(noise < 0.2 * squares);
    CHECK(error >= 0.5 * estimate);
    CHECK(error <= 2 * estimate);
  }
}
