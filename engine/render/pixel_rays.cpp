#include "engine/render/pixel_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace penumbra::render {
namespace {

using math::Color;

constexpr int pixels_per_lens_check = 4;
constexpr std::uint64_t pattern_place = 1, lens_check_place = 2, first_sample_place = 16;

}  // namespace

double squared_error(const Color& value, const Color& variance, double light_error) {
  const auto channel = [](double v, double variance_of_v) {
    if (!(variance_of_v > 0)) return variance_of_v;
    // What clamping leaves of a normally distributed error, within a few hundredths.
    const double above = (v - 1) / std::sqrt(variance_of_v);
    if (above < 0) {
      const double near = std::max(0.0, 1 + above / 4);
      return variance_of_v * (1 - 0.5 * near * near * near);
    }
    const double near = std::max(0.0, 1 - above / 3.2);
    return variance_of_v * 0.5 * near * near * near * near * near;
  };
  const Color all = variance + math::grey(light_error * light_error);
  return channel(value.r, all.r) + channel(value.g, all.g) + channel(value.b, all.b);
}

geometry::Ray PixelRays::center_ray(int column, int row, const sampling::Place& lens) const {
  const sampling::Point2 through =
      has_lens() ? square_to_disc(sampling::CameraPattern(lens.key()).sample(0).lens) : sampling::Point2{0, 0};
  return camera_.ray(column + 0.5, row + 0.5, through);
}

void PixelRays::trace_centers(const PixelBlock& block, const shading::DiscSampling& sampling,
                              shading::Integrator& integrator, Pixel* pixels) const {
  const auto places = block.places();
  const auto rays = shading::array_of<shading::lane_count>([&](std::size_t i) {
    const auto [column, row] = places[i];
    const sampling::Key pixel_key = key(column, row);
    return CameraRay{center_ray(column, row, {pixel_key, pattern_place}),
                     pixel_key.at(first_sample_place),
                     {static_cast<double>(column), static_cast<double>(row)}};
  });
  std::array<Sample, shading::lane_count> samples;
  integrator.trace(std::span(rays).first(block.size()), sampling, samples.data());
  for (std::size_t i = 0; i < block.size(); ++i) {
    const Sample& seen = samples[i];
    pixels[i] = {seen.radiance,
                 has_lens() ? squared_error_of_lens(places[i], seen, sampling, integrator)
                            : squared_error(seen.radiance, seen.variance.measured, seen.light_error),
                 seen.light_error};
  }
}

double PixelRays::squared_error_of_lens(const PixelBlock::Place& pixel, const Sample& seen,
                                        const shading::DiscSampling& sampling, shading::Integrator& integrator) const {
  const auto [column, row] = pixel;
  const sampling::Key pixel_key = key(column, row), place = pixel_key.at(lens_check_place);
  if (place.bits() % pixels_per_lens_check != 0) return 0;
  const geometry::Ray other = center_ray(column, row, {pixel_key, lens_check_place});
  const Color apart = integrator.trace(other, sampling, place.at(first_sample_place)).radiance - seen.radiance;
  return pixels_per_lens_check * squared_error(seen.radiance, apart * apart * 0.5, seen.light_error);
}

PixelRays::Several::Several(const PixelRays& rays, int column, int row)
    : rays_(&rays),
      column_(column),
      row_(row),
      key_(rays.key(column, row).at(first_sample_place)),
      pattern_(rays.key(column, row).at(pattern_place)) {}

PixelRays::CameraRay PixelRays::Several::ray(std::uint32_t index) const {
  const auto [place, lens] = pattern_.sample(index);
  return through(place, lens, index);
}

PixelRays::CameraRay PixelRays::Several::ray_at(const sampling::Point2& place, std::uint32_t index) const {
  return through(place, pattern_.sample(index).lens, index);
}

PixelRays::CameraRay PixelRays::Several::through(const sampling::Point2& place, const sampling::Point2& lens,
                                                 std::uint32_t index) const {
  const sampling::Point2 disc = rays_->has_lens() ? square_to_disc(lens) : sampling::Point2{0, 0};
  const double x = column_ + place.x, y = row_ + place.y;
  return {rays_->camera_.ray(x, y, disc), key_.of_sample(index), {x, y}};
}

}  // namespace penumbra::render
