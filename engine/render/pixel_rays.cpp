#include "engine/render/pixel_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace penumbra::render {
namespace {

using math::Color;

constexpr int pixels_per_lens_check = 4;
constexpr std::uint64_t pattern_place = 1, lens_check_place = 2, first_sample_place = 16;

/// What `of_lane` makes of each of `width` places.
template <std::size_t width, class OfLane>
auto for_each_lane(const OfLane& of_lane) {
  return [&]<std::size_t... lane>(std::index_sequence<lane...>) { return std::array{of_lane(lane)...}; }
  (std::make_index_sequence<width>());
}

}  // namespace

double squared_error(const Color& value, const Color& variance) {
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
  return channel(value.r, variance.r) + channel(value.g, variance.g) + channel(value.b, variance.b);
}

geometry::Ray PixelRays::center_ray(int column, int row, const sampling::Key& lens_key) const {
  const sampling::Point2 lens =
      has_lens() ? square_to_disc(sampling::CameraPattern(lens_key).sample(0).lens) : sampling::Point2{0, 0};
  return camera_.ray(column + 0.5, row + 0.5, lens);
}

PixelRays::Center PixelRays::center(int column, int row) const {
  const geometry::Ray ray = center_ray(column, row, key(column, row).at(pattern_place));
  return {column, row, ray, accel::closest_hit(scene_.world, ray)};
}

void PixelRays::centers(const PixelBlock& block, Center* centers, bool has_bundles,
                        shading::Integrator& integrator) const {
  if (!has_bundles) {
    for (std::size_t i = 0; i < block.size(); ++i) centers[i] = center(block.column(i), block.row(i));
    return;
  }
  for (std::size_t first = 0; first < block.size(); first += accel::bundle_width) {
    const auto rays = for_each_lane<accel::bundle_width>([&](std::size_t i) {
      const std::size_t pixel = std::min(first + i, block.size() - 1);
      return camera_.ray(block.column(pixel) + 0.5, block.row(pixel) + 0.5, {0, 0});
    });
    const auto prepared = for_each_lane<accel::bundle_width>(
        [&](std::size_t i) { return geometry::PreparedRay(rays[i].origin, rays[i].direction); });
    const std::size_t size = std::min(accel::bundle_width, block.size() - first);
    std::array<std::optional<accel::Hit>, accel::bundle_width> hits;
    integrator.camera_hits(std::span(prepared).first(size), hits.data());
    for (std::size_t i = 0; i < size; ++i)
      centers[first + i] = {block.column(first + i), block.row(first + i), rays[i], hits[i]};
  }
}

shading::Integrator::Sample PixelRays::trace(const Center& center, const shading::DiscSampling& sampling,
                                             shading::Integrator& integrator) const {
  shading::Integrator::Sample sample;
  trace({&center, 1}, sampling, integrator, &sample);
  return sample;
}

void PixelRays::trace(std::span<const Center> centers, const shading::DiscSampling& sampling,
                      shading::Integrator& integrator, shading::Integrator::Sample* samples) const {
  const auto rays = for_each_lane<shading::lane_count>([&](std::size_t i) {
    const Center& center = centers[std::min(i, centers.size() - 1)];
    return shading::Integrator::CameraRay{
        center.ray, center.hit, key(center.column, center.row).at(first_sample_place), {center.column, center.row}};
  });
  integrator.trace(std::span(rays).first(centers.size()), sampling, samples);
}

Pixel PixelRays::pixel_of(const Center& center, const shading::Integrator::Sample& sample,
                          const shading::DiscSampling& sampling, shading::Integrator& integrator) const {
  return {sample.radiance, has_lens() ? squared_error_of_lens(center, sample.radiance, sampling, integrator)
                                      : squared_error(sample.radiance, sample.variance.measured)};
}

double PixelRays::squared_error_of_lens(const Center& center, const Color& color, const shading::DiscSampling& sampling,
                                        shading::Integrator& integrator) const {
  const sampling::Key place = key(center.column, center.row).at(lens_check_place);
  if (place.bits() % pixels_per_lens_check != 0) return 0;
  const geometry::Ray other = center_ray(center.column, center.row, place);
  const Color apart = integrator.trace(other, sampling, place.at(first_sample_place)).radiance - color;
  return pixels_per_lens_check * squared_error(color, apart * apart * 0.5);
}

PixelRays::Several::Several(const PixelRays& rays, int column, int row)
    : rays_(&rays),
      column_(column),
      row_(row),
      key_(rays.key(column, row).at(first_sample_place)),
      pattern_(rays.key(column, row).at(pattern_place)) {}

shading::Integrator::Sample PixelRays::Several::trace(std::uint32_t index, const shading::DiscSampling& sampling,
                                                      shading::Integrator& integrator) const {
  const auto [place, lens] = pattern_.sample(index);
  return through(place, lens, index, sampling, integrator);
}

shading::Integrator::Sample PixelRays::Several::trace_at(const sampling::Point2& place, std::uint32_t index,
                                                         const shading::DiscSampling& sampling,
                                                         shading::Integrator& integrator) const {
  return through(place, pattern_.sample(index).lens, index, sampling, integrator);
}

shading::Integrator::Sample PixelRays::Several::through(const sampling::Point2& place, const sampling::Point2& lens,
                                                        std::uint32_t index, const shading::DiscSampling& sampling,
                                                        shading::Integrator& integrator) const {
  const sampling::Point2 disc = rays_->has_lens() ? square_to_disc(lens) : sampling::Point2{0, 0};
  const geometry::Ray ray = rays_->camera_.ray(column_ + place.x, row_ + place.y, disc);
  return integrator.trace(ray, sampling, key_.of_sample(index));
}

}  // namespace penumbra::render
