#include "engine/render/refine.h"

#include <algorithm>
#include <cmath>

namespace penumbra::render {
namespace {

using math::Color;

constexpr int first_refinement = 8;  // samples before the first look at the error
constexpr std::uint64_t pixel_place = 1, lens_place = 2, first_sample_place = 16;

/// Clamped to display range, as the error is measured: a channel surely above 1 has none.
double squared_error(const Color& value, const Color& variance) {
  const auto channel = [](double v, double variance_of_v) {
    return v - 3 * std::sqrt(variance_of_v) > 1 ? 0 : variance_of_v;
  };
  return channel(value.r, variance.r) + channel(value.g, variance.g) + channel(value.b, variance.b);
}

}  // namespace

std::vector<Pass> plan_passes(const scene::Options& options) {
  const auto pixels = static_cast<double>(options.width) * options.height;
  const auto pass = [&](int stride, int samples_per_pixel, int shadow_samples) {
    const double work = pixels * samples_per_pixel * (1 + 0.25 * shadow_samples) / (stride * stride);
    return Pass{stride, samples_per_pixel, shadow_samples, static_cast<std::uint64_t>(work) + 1'000'000};
  };
  if (!options.time_budget_s) return {pass(1, options.samples_per_pixel, options.shadow_samples)};
  std::vector<Pass> passes{pass(8, 1, 1), pass(1, 1, 1)};
  while (passes.back().samples_per_pixel < options.samples_per_pixel ||
         passes.back().shadow_samples < options.shadow_samples) {
    const Pass& last = passes.back();
    passes.push_back(pass(1, std::min(4 * last.samples_per_pixel, options.samples_per_pixel),
                          std::min(4 * last.shadow_samples, options.shadow_samples)));
  }
  return passes;
}

PixelSampler::PixelSampler(const shading::Scene& scene, const Camera& camera, const scene::Options& options,
                           const Pass& pass, bool use_candidates)
    : scene_(scene),
      camera_(camera),
      options_(options),
      samples_per_pixel_(pass.samples_per_pixel),
      use_candidates_(use_candidates) {
  if (options.target_error) {
    for (int count = first_refinement; count < pass.shadow_samples; count *= 4) samplings_.emplace_back(count);
  }
  samplings_.emplace_back(pass.shadow_samples);
}

shading::Integrator PixelSampler::integrator(const std::function<bool()>& is_stopped) const {
  return {scene_, {options_.max_depth, options_.min_contribution, use_candidates_}, is_stopped};
}

PixelSampler::Pixel PixelSampler::sample(int column, int row, shading::Integrator& integrator) const {
  return samples_per_pixel_ > 1 ? with_camera_samples(column, row, integrator)
                                : with_one_camera_ray(column, row, integrator);
}

PixelSampler::Pixel PixelSampler::with_one_camera_ray(int column, int row, shading::Integrator& integrator) const {
  const sampling::Key key =
      sampling::Key(options_.seed).at(static_cast<std::uint64_t>(row)).at(static_cast<std::uint64_t>(column));
  const sampling::Point2 lens =
      camera_.has_lens() ? square_to_disc(sampling::sobol_owen(0, key.at(lens_place))) : sampling::Point2{0, 0};
  const geometry::Ray ray = camera_.ray(column + 0.5, row + 0.5, lens);
  Pixel pixel;
  for (const shading::DiscSampling& sampling : samplings_) {
    const auto sample = integrator.trace(ray, sampling, key.at(first_sample_place));
    pixel = {sample.radiance, squared_error(sample.radiance, sample.variance)};
    const double worst = math::max_channel(sample.variance);
    if (options_.target_error && std::sqrt(worst) < *options_.target_error) break;
  }
  return pixel;
}

PixelSampler::Pixel PixelSampler::with_camera_samples(int column, int row, shading::Integrator& integrator) const {
  const sampling::Key key =
      sampling::Key(options_.seed).at(static_cast<std::uint64_t>(row)).at(static_cast<std::uint64_t>(column));
  const sampling::Key pixel_key = key.at(pixel_place), lens_key = key.at(lens_place);
  Color sum, squares;
  int count = 0;
  Color variance;
  while (count < samples_per_pixel_) {
    const auto index = static_cast<std::uint32_t>(count);
    const sampling::Point2 offset = sampling::sobol_owen(index, pixel_key);
    const sampling::Point2 lens =
        camera_.has_lens() ? square_to_disc(sampling::sobol_owen(index, lens_key)) : sampling::Point2{0, 0};
    const geometry::Ray ray = camera_.ray(column + offset.x, row + offset.y, lens);
    const Color value = integrator.trace(ray, samplings_.back(), key.at(first_sample_place + index)).radiance;
    sum += value;
    squares += value * value;
    ++count;
    const bool is_look = (count & (count - 1)) == 0 && count >= first_refinement;
    if (count != samples_per_pixel_ && !(options_.target_error && is_look)) continue;
    // Well-spread samples: the variance of the mean falls like count^−1.5 (see shading::spread_variance).
    const Color mean = sum * (1.0 / count);
    const double scale = shading::spread_variance / (count * std::sqrt(static_cast<double>(count)));
    const auto of = [&](double square, double m) { return std::max(0.0, square / count - m * m) * scale; };
    variance = {of(squares.r, mean.r), of(squares.g, mean.g), of(squares.b, mean.b)};
    if (options_.target_error && std::sqrt(math::max_channel(variance)) < *options_.target_error) break;
  }
  const Color mean = sum * (1.0 / count);
  return {mean, squared_error(mean, variance)};
}

}  // namespace penumbra::render
