#include "engine/render/refine.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

namespace penumbra::render {
namespace {

using math::Color;

constexpr std::size_t first_refinement = 8;  // samples before the first look at the error
constexpr int pixels_per_lens_check = 8;
constexpr std::uint64_t pixel_place = 1, lens_place = 2, block_place = 3, first_sample_place = 16;

/// Just outside a pixel: whatever line cuts off a piece of it has one of these on that piece's side.
constexpr std::array<sampling::Point2, 4> corners_around{
    sampling::Point2{-0.25, -0.25}, {1.25, -0.25}, {1.25, 1.25}, {-0.25, 1.25}};

/// Clamped to display range, as the error is measured: a channel surely above 1 has none.
double squared_error(const Color& value, const Color& variance) {
  const auto channel = [](double v, double variance_of_v) {
    return v - 3 * std::sqrt(variance_of_v) > 1 ? 0 : variance_of_v;
  };
  return channel(value.r, variance.r) + channel(value.g, variance.g) + channel(value.b, variance.b);
}

/// What `of_lane` makes of each place in a bundle.
template <class OfLane>
auto for_each_lane(const OfLane& of_lane) {
  return [&]<std::size_t... lane>(std::index_sequence<lane...>) { return std::array{of_lane(lane)...}; }
  (std::make_index_sequence<accel::bundle_width>());
}

}  // namespace

std::vector<Pass> plan_passes(const scene::Options& options) {
  const auto pixels = static_cast<double>(options.width) * options.height;
  const auto pass = [&](int stride, int samples_per_pixel, int shadow_samples) {
    const double work = pixels * samples_per_pixel * (1 + 0.25 * shadow_samples) / (stride * stride);
    return Pass{stride, samples_per_pixel, shadow_samples, static_cast<std::uint64_t>(work) + 1'000'000};
  };
  if (!options.time_budget_s) return {pass(1, options.samples_per_pixel, options.shadow_samples)};
  // The first, which nothing cuts short, has a block for each tile. Two camera rays of a pixel that asks for several
  // tell how far they are off; one, at its centre, would not.
  std::vector<Pass> passes{pass(Canvas::tile_edge, 1, 1), pass(8, 1, 1),
                           pass(1, std::min(2, options.samples_per_pixel), 1)};
  while (passes.back().samples_per_pixel < options.samples_per_pixel ||
         passes.back().shadow_samples < options.shadow_samples) {
    const Pass& last = passes.back();
    passes.push_back(pass(1, std::min(4 * last.samples_per_pixel, options.samples_per_pixel),
                          std::min(4 * last.shadow_samples, options.shadow_samples)));
  }
  return passes;
}

PixelSampler::PixelSampler(const shading::Scene& scene, const Camera& camera, const scene::Options& options,
                           const Pass& pass, const Switches& switches)
    : scene_(scene),
      camera_(camera),
      options_(options),
      stride_(pass.stride),
      samples_per_pixel_(pass.samples_per_pixel),
      switches_(switches) {
  if (options.target_error) {
    for (int count = int{first_refinement}; count < pass.shadow_samples; count *= 4) samplings_.emplace_back(count);
  }
  samplings_.emplace_back(pass.shadow_samples);
}

shading::Integrator PixelSampler::integrator(const std::function<bool()>& is_stopped) const {
  return {scene_, {options_.max_depth, options_.min_contribution, camera_.pixel_width(), switches_}, is_stopped};
}

std::optional<math::Color> PixelSampler::background_of(const Canvas::Tile& tile) const {
  const accel::World& world = scene_.world;
  if (!world.infinite_items.empty()) return std::nullopt;
  const std::optional<accel::Shaft> shaft = camera_.shaft(tile.left, tile.top, tile.right, tile.bottom);
  if (!shaft || !shaft->misses(accel::bounds_of(world.structure))) return std::nullopt;
  return scene_.background;
}

void PixelSampler::sample(int column, int row, std::span<Pixel> pixels, shading::Integrator& integrator) const {
  if (stride_ > 1 || samples_per_pixel_ > 1 || camera_.has_lens() || !switches_.camera_bundles) {
    for (Pixel& pixel : pixels) pixel = sample_block(column++, row, integrator);
    return;
  }
  const auto rays = for_each_lane([&](std::size_t i) { return centre_ray(column + static_cast<int>(i), row); });
  const auto prepared =
      for_each_lane([&](std::size_t i) { return geometry::PreparedRay(rays[i].origin, rays[i].direction); });
  std::array<std::optional<accel::Hit>, accel::bundle_width> hits;
  integrator.camera_hits(std::span(prepared).first(pixels.size()), hits.data());
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = with_centre_ray(column + static_cast<int>(i), row, rays[i], hits[i], integrator);
}

PixelSampler::Pixel PixelSampler::sample_block(int column, int row, shading::Integrator& integrator) const {
  Pixel pixel = sample_one(column, row, integrator);
  if (stride_ > 1) {
    // Another pixel of the block shows what it costs that one stands for all.
    const sampling::Key place = pixel_key(column, row).at(block_place);
    const auto away = [&](int axis) { return static_cast<int>(place.uniform(axis) * stride_) - stride_ / 2; };
    const Color other = sample_one(column + away(0), row + away(1), integrator).color;
    const auto squared = [](double a, double b) {
      const double difference = std::clamp(a, 0.0, 1.0) - std::clamp(b, 0.0, 1.0);
      return difference * difference;
    };
    pixel.squared_error =
        squared(pixel.color.r, other.r) + squared(pixel.color.g, other.g) + squared(pixel.color.b, other.b);
  }
  return pixel;
}

PixelSampler::Pixel PixelSampler::sample_one(int column, int row, shading::Integrator& integrator) const {
  if (samples_per_pixel_ > 1) return with_camera_samples(column, row, integrator);
  if (camera_.has_lens()) return with_lens(column, row, integrator);
  const geometry::Ray ray = centre_ray(column, row);
  return with_centre_ray(column, row, ray, accel::closest_hit(scene_.world, ray), integrator);
}

sampling::Key PixelSampler::pixel_key(int column, int row) const {
  return sampling::Key(options_.seed).at(static_cast<std::uint64_t>(row)).at(static_cast<std::uint64_t>(column));
}

template <class Trace>
PixelSampler::Pixel PixelSampler::refined(const Trace& trace) const {
  Pixel pixel;
  for (const shading::DiscSampling& sampling : samplings_) {
    const shading::Integrator::Sample sample = trace(sampling);
    pixel = {sample.radiance, squared_error(sample.radiance, sample.variance.measured)};
    if (is_good_enough(sample.variance)) break;
  }
  return pixel;
}

PixelSampler::Pixel PixelSampler::with_centre_ray(int column, int row, const geometry::Ray& ray,
                                                  const std::optional<accel::Hit>& hit,
                                                  shading::Integrator& integrator) const {
  const sampling::Key key = pixel_key(column, row).at(first_sample_place);
  return refined([&](const shading::DiscSampling& sampling) { return integrator.trace(ray, hit, sampling, key); });
}

PixelSampler::Pixel PixelSampler::with_lens(int column, int row, shading::Integrator& integrator) const {
  const sampling::Key key = pixel_key(column, row);
  const auto trace = [&](std::uint32_t index, const shading::DiscSampling& sampling) {
    const sampling::Point2 lens = square_to_disc(sampling::sobol_owen(index, key.at(lens_place)));
    return integrator.trace(camera_.ray(column + 0.5, row + 0.5, lens), sampling, key.at(first_sample_place + index));
  };
  Pixel pixel = refined([&](const shading::DiscSampling& sampling) { return trace(0, sampling); });
  // One point of the lens cannot tell how the others differ. A second ray of some pixels does, for all of them.
  pixel.squared_error = 0;
  if (key.bits() % pixels_per_lens_check == 0) {
    const Color apart = trace(1, samplings_.back()).radiance - pixel.color;
    pixel.squared_error = pixels_per_lens_check * squared_error(pixel.color, apart * apart * 0.5);
  }
  return pixel;
}

PixelSampler::Pixel PixelSampler::with_camera_samples(int column, int row, shading::Integrator& integrator) const {
  const sampling::Key key = pixel_key(column, row);
  for (const shading::DiscSampling& sampling : samplings_) {
    const Attempt result = attempt(key, column, row, sampling, integrator);
    // More shadow samples help where it is the lights that are noisy.
    const bool is_light_quiet =
        options_.target_error && result.light_variance < 0.25 * *options_.target_error * *options_.target_error;
    if (result.is_good_enough || is_light_quiet || &sampling == &samplings_.back()) return result.pixel;
  }
  return {};  // there is always one sampling
}

PixelSampler::Attempt PixelSampler::attempt(const sampling::Key& key, int column, int row,
                                            const shading::DiscSampling& sampling,
                                            shading::Integrator& integrator) const {
  const sampling::Key place_key = key.at(pixel_place), lens_key = key.at(lens_place);
  std::vector<Color> values;
  values.reserve(static_cast<std::size_t>(samples_per_pixel_));
  Color sum, squares, light_variance;
  std::optional<Color> contrast;
  const auto trace = [&](std::uint32_t index, const sampling::Point2& offset) {
    const sampling::Point2 lens =
        camera_.has_lens() ? square_to_disc(sampling::sobol_owen(index, lens_key)) : sampling::Point2{0, 0};
    const geometry::Ray ray = camera_.ray(column + offset.x, row + offset.y, lens);
    return integrator.trace(ray, sampling, key.at(first_sample_place + index));
  };
  while (true) {
    const auto index = static_cast<std::uint32_t>(values.size());
    const auto sample = trace(index, sampling::sobol_owen(index, place_key));
    values.push_back(sample.radiance);
    sum += sample.radiance, squares += sample.radiance * sample.radiance;
    light_variance += sample.variance.modelled;
    const std::size_t count = values.size();
    const bool is_look = options_.target_error && std::has_single_bit(count) && count >= first_refinement;
    const bool is_last = count == static_cast<std::size_t>(samples_per_pixel_);
    if (!is_last && !is_look) continue;
    const auto n = static_cast<double>(count);
    const Color mean = sum * (1 / n);
    const Color spread = squares * (1 / n) - mean * mean;
    // Well-spread samples: the variance of the mean falls like n^−1.5.
    const double scale = shading::spread_variance / (n * std::sqrt(n));
    const auto scaled = [&](double channel) { return std::max(0.0, channel) * scale; };
    sampling::Halves halves;  // of a (0, 2)-sequence: the first and the last samples
    for (std::size_t i = 0; i < count; ++i) halves.add(2 * i >= count, values[i]);
    shading::Variance variance{halves.variance(sampling::Halves::points),
                               {scaled(spread.r), scaled(spread.g), scaled(spread.b)}};
    bool stops = is_good_enough(variance);
    if (stops && !is_last) {
      // That the samples agree does not mean that all would: half a sample more may see what lies around the pixel.
      if (!contrast) {
        contrast = math::black;
        for (std::uint32_t i = 0; i < corners_around.size(); ++i) {
          const Color beside = trace(static_cast<std::uint32_t>(samples_per_pixel_) + i, corners_around[i]).radiance;
          const auto widen = [](double& channel, double a, double b) {
            channel = std::max(channel, std::fabs(std::clamp(a, 0.0, 1.0) - std::clamp(b, 0.0, 1.0)));
          };
          widen(contrast->r, beside.r, mean.r), widen(contrast->g, beside.g, mean.g);
          widen(contrast->b, beside.b, mean.b);
        }
      }
      const double share = 0.5 / (n + 1);
      const Color unknown = *contrast * *contrast * (share * (1 - share) * scale);
      variance.modelled = {std::max(variance.modelled.r, unknown.r), std::max(variance.modelled.g, unknown.g),
                           std::max(variance.modelled.b, unknown.b)};
      stops = is_good_enough(variance);
    }
    if (is_last || stops)
      return {{mean, squared_error(mean, variance.measured)}, stops, math::max_channel(light_variance) / (n * n)};
  }
}

bool PixelSampler::is_good_enough(const shading::Variance& variance) const {
  const double worst = std::max(math::max_channel(variance.measured), math::max_channel(variance.modelled));
  return options_.target_error && std::sqrt(worst) < *options_.target_error;
}

}  // namespace penumbra::render
