#include "engine/render/sample_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

namespace penumbra::render {
namespace {

/// Of the squared error that is allowed: squares here and there may look better than the whole.
constexpr double of_allowed = 0.6;
/// One square of so many is looked at with few samples, and of those that are off some with more.
constexpr int squares_per_look = 8, least_looks = 64;
constexpr std::size_t most_again = 256;
constexpr int looks_at_lights = 128;

/// The squares of the picture to look at, spread evenly: Roberts' sequence of the plastic number.
class Looks {
 public:
  Looks(int width, int height) : columns_(width / edge), rows_(height / edge) {}
  int squares() const { return columns_ * rows_; }
  PixelBlock at(int look) const {
    const auto part = [&](double step) { return std::fmod(0.5 + step * (look + 1), 1.0); };
    const int column = static_cast<int>(part(0.7548776662466927) * columns_) * edge;
    const int row = static_cast<int>(part(0.5698402909980532) * rows_) * edge;
    return {column, row, column + edge, row + edge};
  }
  static constexpr int edge = PixelBlock::edge;

 private:
  int columns_, rows_;
};

}  // namespace

int samples_for_target(const PixelRays& rays, int width, int height, double target, int most,
                       shading::Integrator& integrator) {
  const Looks at(width, height);
  const int looks = std::min(at.squares(), std::max(least_looks, at.squares() / squares_per_look));
  int count = std::min(2, most);
  if (looks == 0) return most;
  std::array<Pixel, shading::lane_count> pixels;
  const auto error_of = [&](const PixelBlock& block, const shading::DiscSampling& sampling) {
    rays.trace_centers(block, sampling, integrator, pixels.data());
    double sum = 0;
    for (const Pixel& pixel : std::span(pixels).first(block.size())) sum += pixel.squared_error;
    return sum;
  };
  struct Look {
    PixelBlock block;
    double error;
  };
  std::vector<Look> off;
  double sum = 0;
  const shading::DiscSampling few(count);
  for (int i = 0; i < looks; ++i) {
    const PixelBlock block = at.at(i);
    if (const double error = error_of(block, few); error > 0) off.push_back({block, error}), sum += error;
  }
  const double allowed = of_allowed * 3 * target * target * looks * Looks::edge * Looks::edge;
  const std::size_t step = off.size() / most_again + 1;
  double before = 0;
  for (std::size_t i = 0; i < off.size(); i += step) before += off[i].error;
  for (double now = before; sum * now > allowed * before && count < most;) {
    count = std::min(2 * count, most);
    const shading::DiscSampling more(count);
    now = 0;
    for (std::size_t i = 0; i < off.size(); i += step) now += error_of(off[i].block, more);
  }
  return count;
}

double light_error_of(const PixelRays& rays, int width, int height, shading::Integrator& integrator) {
  const Looks at(width, height);
  const int looks = std::min(at.squares(), looks_at_lights);
  if (looks == 0) return math::infinity;
  const shading::DiscSampling few(1);
  std::array<Pixel, shading::lane_count> pixels;
  double sum = 0, count = 0;
  for (int i = 0; i < looks; ++i) {
    const PixelBlock block = at.at(i);
    rays.trace_centers(block, few, integrator, pixels.data());
    for (const Pixel& pixel : std::span(pixels).first(block.size()))
      sum += pixel.light_error * pixel.light_error, count += 1;
  }
  return std::sqrt(sum / count);
}

}  // namespace penumbra::render
