#include "engine/render/refine.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/math/elementary.h"
#include "engine/render/sample_choice.h"

namespace penumbra::render {
namespace {

using math::Color;

constexpr std::uint64_t block_place = 3;
/// Pixels farther apart than this have too little in common to look for it.
constexpr int widest_stride_of_cells = 4;
/// Of squares that are many, one of so many is looked at again.
constexpr std::uint64_t squares_per_check = 4, small_squares_per_check = 16;
constexpr int small_square = 4;

}  // namespace

std::vector<Pass> plan_passes(const scene::Options& options) {
  const auto pixels = static_cast<double>(options.width) * options.height;
  const auto pass = [&](int stride, int samples_per_pixel, int shadow_samples) {
    const double work = pixels * samples_per_pixel * (1 + 0.25 * shadow_samples) / (stride * stride);
    return Pass{stride, samples_per_pixel, shadow_samples, static_cast<std::uint64_t>(work) + 1'000'000};
  };
  if (!options.time_budget_s) return {pass(1, options.samples_per_pixel, options.shadow_samples)};
  // The first, which nothing cuts short, has a block for each tile. Two camera rays of a pixel that asks for several
  // tell how far they are off; one, at its center, would not.
  std::vector<Pass> passes{pass(Canvas::tile_edge, 1, 1), pass(8, 1, 1), pass(4, 1, 1), pass(2, 1, 1),
                           pass(1, std::min(2, options.samples_per_pixel), 1)};
  while (passes.back().samples_per_pixel < options.samples_per_pixel ||
         passes.back().shadow_samples < options.shadow_samples) {
    const Pass& last = passes.back();
    passes.push_back(pass(1, std::min(4 * last.samples_per_pixel, options.samples_per_pixel),
                          std::min(4 * last.shadow_samples, options.shadow_samples)));
  }
  return passes;
}

Pass preview_pass() { return {16, 1, 1}; }

PixelSampler::PixelSampler(const shading::Scene& scene, const Camera& camera, const scene::Options& options,
                           const Pass& pass, const Switches& switches)
    : scene_(scene),
      camera_(camera),
      options_(options),
      stride_(pass.stride),
      samples_per_pixel_(pass.samples_per_pixel),
      switches_(switches),
      sampling_(pass.shadow_samples),
      rays_(camera, options.seed) {
  sampling_.may_lean = pass.samples_per_pixel == 1;
  if (!options.target_error) return;
  const double target = *options.target_error / math::power_of_two(options.exposure);
  light_error_ = light_error_share * target;
  if (stride_ == 1 && samples_per_pixel_ > 1)
    refiner_.emplace(rays_, target, pass.samples_per_pixel, pass.shadow_samples);
}

shading::Integrator PixelSampler::integrator(const std::function<bool()>& is_stopped) const {
  return integrator(is_stopped, stride_ <= widest_stride_of_cells);
}

shading::Integrator PixelSampler::integrator(const std::function<bool()>& is_stopped, bool has_neighbours) const {
  shading::Switches switches = switches_;
  switches.light_cells = switches.light_cells && has_neighbours;
  return {scene_,
          {options_.max_depth, options_.min_contribution, camera_.pixel_width(), switches, light_error_},
          is_stopped};
}

void PixelSampler::prepare(int least, const std::function<bool()>& is_stopped) {
  if (!options_.target_error || stride_ > 1 || samples_per_pixel_ > 1) return;
  const double target = *options_.target_error / math::power_of_two(options_.exposure);
  // If the picture was further off than it seemed to pixels here and there, bounds are safe.
  if (least == 0) choose_light_error(light_error_share * target, is_stopped);
  shading::Integrator looking = integrator(is_stopped, false);
  const int most = sampling_.spiral.count();
  const int chosen = samples_for_target(rays_, options_.width, options_.height, target, most, looking);
  sampling_ = shading::DiscSampling(std::min(most, std::max(least, chosen)));
}

void PixelSampler::choose_light_error(double allowed, const std::function<bool()>& is_stopped) {
  if (!scene_.light_tree || !switches_.light_tree || !switches_.drawn_lights) return;
  constexpr double least_step = 0.8;
  for (light_error_ = most_light_error * allowed; light_error_ > allowed;) {
    shading::Integrator looking = integrator(is_stopped, false);
    const double found = light_error_of(rays_, options_.width, options_.height, looking);
    if (found <= allowed) return;
    light_error_ *= std::min(least_step, allowed / found);
  }
  light_error_ = allowed;
}

std::optional<Color> PixelSampler::background_of(const Canvas::Tile& tile) const {
  const accel::World& world = scene_.world;
  if (!world.infinite_items.empty()) return std::nullopt;
  const std::optional<accel::HalfSpaces> seen = camera_.pyramid(tile.left, tile.top, tile.right, tile.bottom);
  if (!seen || !seen->miss(accel::bounds_of(world.structure))) return std::nullopt;
  return scene_.background;
}

std::vector<Pixel> PixelSampler::sample(const Canvas::Tile& tile, const std::function<bool()>& is_stopped,
                                        shading::Integrator& integrator) const {
  if (refiner_) return refiner_->refine(tile, is_stopped, integrator);
  const auto columns = static_cast<std::size_t>((tile.right - tile.left + stride_ - 1) / stride_);
  const auto rows = static_cast<std::size_t>((tile.bottom - tile.top + stride_ - 1) / stride_);
  std::vector<Pixel> pixels(columns * rows);
  std::array<Pixel, shading::lane_count> found;
  for_each_block(tile, stride_, [&](const PixelBlock& block) {
    if (is_stopped()) return;
    sample(block, integrator, found.data());
    if (stride_ > 1) {
      const auto places = block.places();
      for (std::size_t i = 0; i < block.size(); ++i) stand_for_square(places[i], integrator, found[i]);
    }
    const auto left = static_cast<std::size_t>((block.left - tile.left) / stride_);
    const auto top = static_cast<std::size_t>((block.top - tile.top) / stride_);
    const auto across = static_cast<std::size_t>(block.columns()), down = static_cast<std::size_t>(block.rows());
    for (std::size_t row = 0; row < down; ++row)
      std::copy_n(&found[row * across], across, &pixels[(top + row) * columns + left]);
  });
  return pixels;
}

void PixelSampler::sample(const PixelBlock& block, shading::Integrator& integrator, Pixel* pixels) const {
  if (samples_per_pixel_ > 1) {
    sample_several(block, integrator, pixels);
  } else {
    rays_.trace_centers(block, sampling_, integrator, pixels);
  }
}

void PixelSampler::stand_for_square(const PixelBlock::Place& at, shading::Integrator& integrator, Pixel& pixel) const {
  const auto [column, row] = at;
  const sampling::Key place = rays_.key(column, row).at(block_place);
  // Another pixel of some squares shows what it costs that one stands for all; of all of them where they are few.
  const std::uint64_t per_check = stride_ <= small_square       ? small_squares_per_check
                                  : stride_ < Canvas::tile_edge ? squares_per_check
                                                                : 1;
  pixel.squared_error = 0;
  if (place.bits() % per_check != 0) return;
  const auto away = [&](int axis) { return static_cast<int>(place.uniform(axis) * stride_) - stride_ / 2; };
  const Color other = sample_one(column + away(0), row + away(1), integrator).color;
  const auto squared = [](double a, double b) {
    const double difference = std::clamp(a, 0.0, 1.0) - std::clamp(b, 0.0, 1.0);
    return difference * difference;
  };
  pixel.squared_error =
      static_cast<double>(per_check) *
      (squared(pixel.color.r, other.r) + squared(pixel.color.g, other.g) + squared(pixel.color.b, other.b));
}

Pixel PixelSampler::sample_one(int column, int row, shading::Integrator& integrator) const {
  Pixel pixel;
  sample(PixelBlock{column, row, column + 1, row + 1}, integrator, &pixel);
  return pixel;
}

void PixelSampler::sample_several(const PixelBlock& block, shading::Integrator& integrator, Pixel* pixels) const {
  // As many together as there are lanes, a pixel after the other.
  const auto each = static_cast<std::size_t>(samples_per_pixel_), all = each * block.size();
  std::vector<PixelRays::Several> several;
  const auto places = block.places();
  for (std::size_t i = 0; i < block.size(); ++i) several.emplace_back(rays_, places[i].column, places[i].row);
  std::array<sampling::Halves, shading::lane_count> halves;  // of a sequence: the first and the last samples
  std::array<double, shading::lane_count> light_error{};
  std::array<PixelRays::Sample, shading::lane_count> samples;
  for (std::size_t begin = 0; begin < all; begin += shading::lane_count) {
    const std::size_t count = std::min(shading::lane_count, all - begin);
    const auto rays = shading::array_of<shading::lane_count>([&](std::size_t i) {
      const std::size_t at = begin + std::min(i, count - 1);
      return several[at / each].ray(static_cast<std::uint32_t>(at % each));
    });
    integrator.trace(std::span(rays).first(count), sampling_, samples.data());
    for (std::size_t i = 0; i < count; ++i) {
      halves[(begin + i) / each].add(2 * ((begin + i) % each) >= each, samples[i].radiance);
      light_error[(begin + i) / each] += samples[i].light_error / samples_per_pixel_;
    }
  }
  for (std::size_t i = 0; i < block.size(); ++i)
    pixels[i] = {halves[i].mean(), squared_error(halves[i].mean(), halves[i].variance(rays_.order()), light_error[i])};
}

}  // namespace penumbra::render
