#pragma once
#include <algorithm>
#include <array>

#include "engine/render/camera.h"
#include "engine/render/canvas.h"
#include "engine/shading/integrator.h"

namespace penumbra::render {

/// What is found for a pixel.
struct Pixel {
  math::Color color;
  // Estimated, summed over the channels; 0 where clamping hides it. On average over many: one may even be negative.
  double squared_error = 0;
  double light_error = 0;  // the part of lights that stand for others, of any channel
};

/// The variance of a pixel's color as its squared error, which is measured clamped to display range: a channel far
/// above 1 has none. Lights that stand for others make a `light_error` besides.
double squared_error(const math::Color& value, const math::Color& variance, double light_error = 0);

/// Pixels that are lit together: of a square of the picture, right and bottom exclusive, those in the middle of every
/// `stride` pixels.
struct PixelBlock {
  static constexpr int edge = 4;  // at most, in strides
  int left, top, right, bottom, stride = 1;
  int columns() const { return (right - left + stride - 1) / stride; }
  int rows() const { return (bottom - top + stride - 1) / stride; }
  std::size_t size() const { return static_cast<std::size_t>(columns()) * static_cast<std::size_t>(rows()); }
  /// The pixels, row by row.
  struct Place {
    int column, row;
  };
  std::array<Place, shading::lane_count> places() const {
    std::array<Place, shading::lane_count> result;
    std::size_t count = 0;
    for (int y = top; y < bottom; y += stride) {
      for (int x = left; x < right; x += stride) result[count++] = {middle(x, right), middle(y, bottom)};
    }
    for (; count < result.size(); ++count) result[count] = result[count - 1];
    return result;
  }

 private:
  int middle(int first, int end) const { return (first + std::min(first + stride, end) - 1) / 2; }
};
/// Calls use(block) for the blocks of a tile, row by row.
template <class Use>
void for_each_block(const Canvas::Tile& tile, int stride, const Use& use) {
  const int edge = PixelBlock::edge * stride;
  for (int row = tile.top; row < tile.bottom; row += edge) {
    for (int column = tile.left; column < tile.right; column += edge)
      use(PixelBlock{column, row, std::min(column + edge, tile.right), std::min(row + edge, tile.bottom), stride});
  }
}

/// The camera rays of pixels, and what they see. Immutable; may be shared between threads.
class PixelRays {
 public:
  PixelRays(const Camera& camera, std::uint64_t seed) : camera_(camera), key_(seed) {}

  bool has_lens() const { return camera_.has_lens(); }
  /// How the variance of the mean of several samples falls with their number.
  sampling::Halves::Order order() const {
    return has_lens() ? sampling::Halves::points_through_lens : sampling::Halves::points;
  }
  sampling::Key key(int column, int row) const {
    return key_.at(static_cast<std::uint64_t>(row)).at(static_cast<std::uint64_t>(column));
  }

  using CameraRay = shading::Integrator::CameraRay;
  using Sample = shading::Integrator::Sample;
  /// The pixels of a block, row by row, each with the one ray through its center – and through any point of the lens.
  void trace_centers(const PixelBlock& block, const shading::DiscSampling& sampling, shading::Integrator& integrator,
                     Pixel* pixels) const;

  /// The camera rays of a pixel that has several.
  class Several {
   public:
    Several(const PixelRays& rays, int column, int row);
    CameraRay ray(std::uint32_t index) const;
    /// Beside the pixel: at `place` in units of its square.
    CameraRay ray_at(const sampling::Point2& place, std::uint32_t index) const;

   private:
    CameraRay through(const sampling::Point2& place, const sampling::Point2& lens, std::uint32_t index) const;
    const PixelRays* rays_;
    int column_, row_;
    sampling::Key key_;
    sampling::CameraPattern pattern_;
  };

 private:
  geometry::Ray center_ray(int column, int row, const sampling::Place& lens) const;
  /// The squared error of what is `seen`, found with one ray, on average over many pixels: what the lens hides from it
  /// is added by a few of them for all.
  double squared_error_of_lens(const PixelBlock::Place& pixel, const Sample& seen,
                               const shading::DiscSampling& sampling, shading::Integrator& integrator) const;

  const Camera& camera_;
  sampling::Key key_;
};

}  // namespace penumbra::render
