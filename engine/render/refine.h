#pragma once
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/render/camera.h"
#include "engine/render/canvas.h"
#include "engine/render/pixel_rays.h"
#include "engine/render/switches.h"
#include "engine/render/tile_refiner.h"
#include "engine/scene/options.h"
#include "engine/shading/integrator.h"

namespace penumbra::render {

/// Of the error asked for: what lights that stand for others may make of any channel of a pixel, root mean square. The
/// rest adds to it in squares.
inline constexpr double light_error_share = 0.5;
/// What bounds allow is many times as much as it mostly is: at most so many times are tried.
inline constexpr double most_light_error = 8;

/// One sweep over the image: a sample block every `stride` pixels, with these numbers of samples.
struct Pass {
  int stride = 1;
  int samples_per_pixel = 1, shadow_samples = 64;
  std::uint64_t work = 0;  // arbitrary units, comparable between the passes of one render
};

/// A single pass at the options' sample counts; with a time budget, coarse to fine in steps of four up to them.
std::vector<Pass> plan_passes(const scene::Options& options);
/// What fills a preview until there is better: a hundredth of the work at most.
Pass preview_pass();

/// Chooses and averages the samples of a pass. Once prepared immutable; may be shared between threads. What it finds
/// depends on seed, place and pass alone.
class PixelSampler {
 public:
  PixelSampler(const shading::Scene& scene, const Camera& camera, const scene::Options& options, const Pass& pass,
               const Switches& switches);

  /// The tile's blocks, row by row; left unfinished once `is_stopped`, which the integrator asks as well.
  std::vector<Pixel> sample(const Canvas::Tile& tile, const std::function<bool()>& is_stopped,
                            shading::Integrator& integrator) const;

  /// The color of every pixel of the tile, if it shows nothing but the background for certain.
  std::optional<math::Color> background_of(const Canvas::Tile& tile) const;

  /// To be called once before `sample`: with a target for the error and one camera ray a pixel, chooses how many shadow
  /// samples the whole picture gets, `least` or more.
  void prepare(int least, const std::function<bool()>& is_stopped);
  /// Of each light.
  int shadow_samples() const { return sampling_.spiral.count(); }

  /// An integrator for `sample`, for one thread.
  shading::Integrator integrator(const std::function<bool()>& is_stopped) const;

 private:
  shading::Integrator integrator(const std::function<bool()>& is_stopped, bool has_neighbours) const;
  /// Lets lights stand for others as far as what they make of the picture, told by pixels here and there, is what they
  /// may make of it.
  void choose_light_error(double allowed, const std::function<bool()>& is_stopped);
  void sample(const PixelBlock& block, shading::Integrator& integrator, Pixel* pixels) const;
  Pixel sample_one(int column, int row, shading::Integrator& integrator) const;
  void sample_several(const PixelBlock& block, shading::Integrator& integrator, Pixel* pixels) const;
  /// Finds the error of a pixel that stands for all of a square of `stride_` pixels.
  void stand_for_square(const PixelBlock::Place& at, shading::Integrator& integrator, Pixel& pixel) const;

  const shading::Scene& scene_;
  const Camera& camera_;
  scene::Options options_;
  int stride_, samples_per_pixel_;
  Switches switches_;
  shading::DiscSampling sampling_;
  double light_error_ = 0;  // that lights may make by standing for others
  PixelRays rays_;
  std::optional<TileRefiner> refiner_;
};

}  // namespace penumbra::render
