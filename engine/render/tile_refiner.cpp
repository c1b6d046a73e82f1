#include "engine/render/tile_refiner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

namespace penumbra::render {
namespace {

using math::Color;

constexpr int first_camera_samples = 4, first_shadow_samples = 2;
/// What doubling the samples divides a variance by.
constexpr double least_gain = 2, greatest_gain = 4;
/// A pixel goes on after all where the second half of its samples shows so many times the variance that was asked for.
constexpr double revoking = 2;

/// Just outside a pixel: whatever line cuts off a piece of it has one of these on that piece's side.
constexpr std::array<sampling::Point2, 4> corners_around{
    sampling::Point2{-0.25, -0.25}, {1.25, -0.25}, {1.25, 1.25}, {-0.25, 1.25}};

double sum_of(const Color& c) { return c.r + c.g + c.b; }

/// The ratio of two quantities of many pixels, so that it adds up to nothing a single pixel's luck could decide.
class Ratio {
 public:
  /// `presumed`: of a few pixels beside those that are added.
  explicit Ratio(double presumed) : presumed_(presumed) {}
  void add(double above, double below) { above_ += above, below_ += below, squares_ += below * below; }
  double value() const {
    if (below_ == 0) return presumed_;
    const double few = pixels_presumed * squares_ / below_;
    return (above_ + few * presumed_) / (below_ + few);
  }

 private:
  static constexpr double pixels_presumed = 4;
  double presumed_, above_ = 0, below_ = 0, squares_ = 0;
};

Color squared_distance(const Color& a, const Color& b) {
  const auto channel = [](double x, double y) {
    const double d = std::clamp(x, 0.0, 1.0) - std::clamp(y, 0.0, 1.0);
    return d * d;
  };
  return {channel(a.r, b.r), channel(a.g, b.g), channel(a.b, b.b)};
}

Color positive(const Color& c) { return {std::max(0.0, c.r), std::max(0.0, c.g), std::max(0.0, c.b)}; }

}  // namespace

/// What was last seen in each pixel of a tile.
class TileRefiner::Surroundings {
 public:
  Surroundings(int width, int height)
      : width_(width), height_(height), seen_(static_cast<std::size_t>(width * height)) {}
  void set(std::size_t place, const Color& mean, const Color& spread) {
    seen_[place] = {mean, std::min(1.0, 4 * math::max_channel(spread))};
  }
  /// Some of its neighbours are in another tile.
  bool is_at_border(std::size_t place) const {
    const auto [x, y] = position(place);
    return x == 0 || y == 0 || x + 1 == width_ || y + 1 == height_;
  }
  /// How different from the pixel's mean it may be that its neighbours see, squared.
  double squared_contrast(std::size_t place) const {
    const auto [x, y] = position(place);
    double result = 0;
    for (int row = std::max(0, y - 1); row <= std::min(height_ - 1, y + 1); ++row) {
      for (int column = std::max(0, x - 1); column <= std::min(width_ - 1, x + 1); ++column) {
        const Seen& seen =
            seen_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column)];
        result =
            std::max({result, math::max_channel(squared_distance(seen.mean, seen_[place].mean)), seen.squared_range});
      }
    }
    return result;
  }

 private:
  struct Seen {
    Color mean;
    double squared_range = 0;  // of two values that vary as much
  };
  std::pair<int, int> position(std::size_t place) const {
    return {static_cast<int>(place) % width_, static_cast<int>(place) / width_};
  }
  int width_, height_;
  std::vector<Seen> seen_;
};

/// A pixel with several camera samples, so far.
struct TileRefiner::Several {
  PixelRays::Several rays;
  std::size_t place;  // in the tile
  int count = 0;
  Color sum = {}, sum_of_half = {}, sum_of_squares = {};
  Color apart = {}, apart_before = {};  // of the halves of the samples and of the first half's halves, squared
  double light_variance = 0;            // the soft lights' part of the sum's variance
  double light_error = 0;               // of the sum, from lights that stand for others
  std::optional<double> contrast = {};  // squared, to what is seen beside it where that is another tile's
  bool is_ending = false;

  void restart() { *this = {rays, place, 0, {}, {}, {}, {}, {}, 0, 0, contrast, false}; }
  void take_up_to(int end, const shading::DiscSampling& sampling, shading::Integrator& integrator) {
    std::array<PixelRays::Sample, shading::lane_count> samples;
    while (count < end) {
      const int size = std::min(static_cast<int>(shading::lane_count), end - count);
      const auto together = shading::array_of<shading::lane_count>([&](std::size_t i) {
        return rays.ray(static_cast<std::uint32_t>(count + std::min(static_cast<int>(i), size - 1)));
      });
      integrator.trace(std::span(together).first(static_cast<std::size_t>(size)), sampling, samples.data());
      for (int i = 0; i < size; ++i, ++count) {
        if (count == first_half(end)) sum_of_half = sum;
        const auto& [radiance, variance, light_error_of_sample] = samples[static_cast<std::size_t>(i)];
        sum += radiance, sum_of_squares += radiance * radiance;
        light_variance += math::max_channel(variance.modelled), light_error += light_error_of_sample;
      }
    }
    apart_before = apart, apart = variance(sampling::Halves::independent);
  }
  static int first_half(int n) { return (n + 1) / 2; }
  Color mean() const { return sum * (1.0 / count); }
  Color spread() const { return positive(sum_of_squares * (1.0 / count) - mean() * mean()); }
  /// Of the mean, as the two halves of the samples tell.
  Color variance(sampling::Halves::Order order) const {
    const int half = first_half(count), rest = count - half;
    sampling::Halves halves;
    halves.add(false, sum_of_half * (1.0 / half), half), halves.add(true, (sum - sum_of_half) * (1.0 / rest), rest);
    return halves.variance(order);
  }
};

TileRefiner::TileRefiner(const PixelRays& rays, double target_error, int samples_per_pixel, int shadow_samples)
    : rays_(rays), squared_target_(target_error * target_error), looks_{samples_per_pixel} {
  while (looks_.front() >= 2 * first_camera_samples) looks_.insert(looks_.begin(), Several::first_half(looks_.front()));
  for (int count = first_shadow_samples; count < shadow_samples; count *= 4) samplings_.emplace_back(count);
  samplings_.emplace_back(shadow_samples);
  for (shading::DiscSampling& sampling : samplings_) sampling.may_lean = false;
}

std::vector<Pixel> TileRefiner::refine(const Canvas::Tile& tile, const std::function<bool()>& is_stopped,
                                       shading::Integrator& integrator) const {
  std::vector<Several> active;
  for (int row = tile.top; row < tile.bottom; ++row) {
    for (int column = tile.left; column < tile.right; ++column)
      active.push_back({PixelRays::Several(rays_, column, row), active.size()});
  }
  std::vector<Pixel> pixels(active.size());
  const double cap = looks_.back();
  Surroundings around(tile.right - tile.left, tile.bottom - tile.top);
  for (const shading::DiscSampling& sampling : samplings_) {
    for (std::size_t look = 0; look < looks_.size(); ++look) {
      for (Several& pixel : active) {
        if (is_stopped()) return pixels;
        pixel.take_up_to(looks_[look], sampling, integrator);
        around.set(pixel.place, pixel.mean(), pixel.spread());
      }
      const Trend trend = trend_of(active);
      for (const Several& pixel : active)
        pixels[pixel.place] = {
            pixel.mean(), squared_error(pixel.mean(), pixel.variance(trend.order), pixel.light_error / pixel.count)};
      std::erase_if(active, [&](const Several& pixel) {
        return pixel.is_ending && math::max_channel(pixel.spread()) * trend.of_spread < revoking * squared_target_;
      });
      if (look + 1 < looks_.size()) decide(active, trend, around, sampling, integrator);
    }
    // More shadow samples help where it is the lights that are noisy.
    std::erase_if(active,
                  [&](const Several& pixel) { return pixel.light_variance / (cap * cap) < 0.25 * squared_target_; });
    for (Several& pixel : active) pixel.restart();
  }
  return pixels;
}

TileRefiner::Trend TileRefiner::trend_of(const std::vector<Several>& active) const {
  const double usual_gain = rays_.order().gain();
  Ratio gains(usual_gain);
  for (const Several& pixel : active) {
    if (pixel.count > looks_.front()) gains.add(sum_of(pixel.apart_before), sum_of(pixel.apart));
  }
  const double gain = std::clamp(gains.value(), least_gain, greatest_gain);
  const auto order = sampling::Halves::of_gain(gain);
  // Well-spread samples across edges: the variance falls like n^−1.5, and through a lens like n^−1.25.
  const double n = active.empty() ? 1 : active.front().count, root = std::sqrt(n);
  const double modelled = shading::spread_variance / (n * (rays_.has_lens() ? std::sqrt(root) : root));
  Ratio measured_to_modelled(1);
  for (const Several& pixel : active)
    measured_to_modelled.add(sum_of(pixel.variance(order)), sum_of(pixel.spread()) * modelled);
  return {order, modelled * measured_to_modelled.value(), std::min(gain, usual_gain)};
}

double TileRefiner::contrast_beside(Several& pixel, const shading::DiscSampling& sampling,
                                    shading::Integrator& integrator) const {
  if (!pixel.contrast) {
    pixel.contrast = 0;
    const auto rays = shading::array_of<corners_around.size()>([&](std::size_t i) {
      return pixel.rays.ray_at(corners_around[i],
                               static_cast<std::uint32_t>(looks_.back()) + static_cast<std::uint32_t>(i));
    });
    std::array<PixelRays::Sample, corners_around.size()> beside;
    integrator.trace(rays, sampling, beside.data());
    for (const PixelRays::Sample& sample : beside)
      pixel.contrast = std::max(*pixel.contrast, math::max_channel(squared_distance(sample.radiance, pixel.mean())));
  }
  return *pixel.contrast;
}

void TileRefiner::decide(std::vector<Several>& active, const Trend& trend, const Surroundings& around,
                         const shading::DiscSampling& sampling, shading::Integrator& integrator) const {
  const double will_be = trend.of_spread / trend.gain;
  for (Several& pixel : active) {
    pixel.is_ending = math::max_channel(pixel.spread()) * will_be < squared_target_;
    if (!pixel.is_ending) continue;
    // That the samples agree does not mean that all would: half a sample more may see what the pixels around it see.
    double contrast = around.squared_contrast(pixel.place);
    if (around.is_at_border(pixel.place)) contrast = std::max(contrast, contrast_beside(pixel, sampling, integrator));
    const double share = 0.5 / (pixel.count + 1);
    pixel.is_ending = contrast * share * (1 - share) * will_be < squared_target_;
  }
}

}  // namespace penumbra::render
