// The estimate of an image's own error, against its true error: the difference from a picture of many more samples.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "tests/accuracy/estimate_scenes.h"
#include "tests/support/picture.h"

using namespace penumbra;

namespace {

/// Two pictures of many samples, by other seeds; their mean is the reference, their difference tells its noise.
struct Reference {
  std::vector<float> mean;
  double squared_noise;
};
Reference reference_of(api::JobRequest job) {
  scene::Options& options = job.options;
  options.target_error.reset();
  options.shadow_samples = 1024;
  if (options.samples_per_pixel > 1 || job.scene.camera.lens) {
    options.samples_per_pixel = std::max(16 * options.samples_per_pixel, 256);
    options.shadow_samples = 64;
  }
  options.seed = 1001;
  std::vector<float> a = test::render(job).film.rgb;
  options.seed = 1002;
  const std::vector<float> b = test::render(job).film.rgb;
  const double difference = test::rmse(a, b);
  for (std::size_t i = 0; i < a.size(); ++i)
    a[i] = std::midpoint(std::clamp(a[i], 0.F, 1.F), std::clamp(b[i], 0.F, 1.F));
  return {std::move(a), difference * difference / 4};
}

}  // namespace

TEST_CASE("the estimated error is within a factor of two of the true one") {
  for (test::NamedJob& named : test::estimate_scenes()) {
    const Reference reference = reference_of(named.job);
    for (const int samples : {1, 4, 16, 64, 256}) {
      named.job.options.shadow_samples = samples;
      const render::Picture picture = test::render(named.job);
      const double difference = test::rmse(picture.film.rgb, reference.mean), estimate = picture.stats.estimated_error;
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
  for (test::NamedJob& named : test::estimate_scenes()) {
    const Reference reference = reference_of(named.job);
    scene::Options& options = named.job.options;
    options.shadow_samples = 256;
    // Where camera rays are spread their cap must not be what ends the refinement.
    if (options.samples_per_pixel > 1) options.samples_per_pixel = 1024;
    std::uint64_t rays = 0;
    for (const double target : {0.03, 0.01}) {
      options.target_error = target;
      const render::Picture picture = test::render(named.job);
      const double error = test::rmse(picture.film.rgb, reference.mean);
      INFO(fmt::format("{}, target {}: RMSE {:.2e}, estimated {:.2e}", named.name, target, error,
                       picture.stats.estimated_error));
      // A lens of one ray is noisy whatever the lights do.
      if (named.job.scene.camera.lens && options.samples_per_pixel == 1) continue;
      CHECK(error <= target);
      const std::uint64_t cost = picture.stats.rays.camera + picture.stats.rays.shadow;
      CHECK(cost >= rays);
      rays = cost;
    }
  }
}

TEST_CASE("with a target out of reach the picture is as good as the caps allow") {
  for (test::NamedJob& named : test::estimate_scenes()) {
    named.job.options.shadow_samples = 16;
    const Reference reference = reference_of(named.job);
    const double capped = test::rmse(test::render(named.job).film.rgb, reference.mean);
    named.job.options.target_error = 1e-9;
    INFO(named.name);
    CHECK(test::rmse(test::render(named.job).film.rgb, reference.mean) <= 1.05 * capped);
  }
}
