#pragma once
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/render/camera.h"
#include "engine/render/canvas.h"
#include "engine/render/switches.h"
#include "engine/scene/options.h"
#include "engine/shading/integrator.h"

namespace penumbra::render {

/// One sweep over the image: a sample block every `stride` pixels, with these numbers of samples.
struct Pass {
  int stride = 1;
  int samples_per_pixel = 1, shadow_samples = 64;
  std::uint64_t work = 0;  // arbitrary units, comparable between the passes of one render
};

/// A single pass at the options' sample counts; with a time budget, coarse to fine in steps of four up to them.
std::vector<Pass> plan_passes(const scene::Options& options);

/// Chooses and averages the samples of a pixel. Immutable; may be shared between threads.
class PixelSampler {
 public:
  PixelSampler(const shading::Scene& scene, const Camera& camera, const scene::Options& options, const Pass& pass,
               const Switches& switches);

  struct Pixel {
    math::Color color;
    double squared_error = 0;  // estimated, summed over the channels; 0 where clamping hides it
  };
  /// Fills in up to accel::bundle_width pixels side by side, of which `column` is the first. Each depends on seed,
  /// place and pass alone.
  void sample(int column, int row, std::span<Pixel> pixels, shading::Integrator& integrator) const;

  /// The color of every pixel of the tile, if it shows nothing but the background for certain.
  std::optional<math::Color> background_of(const Canvas::Tile& tile) const;

  /// An integrator for `sample`, for one thread.
  shading::Integrator integrator(const std::function<bool()>& is_stopped) const;

 private:
  Pixel with_camera_samples(int column, int row, shading::Integrator& integrator) const;
  /// One go at a pixel: camera samples up to the cap or until they are good enough.
  struct Attempt {
    Pixel pixel;
    bool is_good_enough;
    double light_variance;  // the soft lights' part of the mean's variance, worst channel
  };
  Attempt attempt(const sampling::Key& key, int column, int row, const shading::DiscSampling& sampling,
                  shading::Integrator& integrator) const;
  sampling::Key pixel_key(int column, int row) const;
  /// One pixel, for its whole block.
  Pixel sample_block(int column, int row, shading::Integrator& integrator) const;
  Pixel sample_one(int column, int row, shading::Integrator& integrator) const;
  Pixel with_lens(int column, int row, shading::Integrator& integrator) const;
  geometry::Ray centre_ray(int column, int row) const { return camera_.ray(column + 0.5, row + 0.5, {0, 0}); }
  /// The ray through the pixel's centre meets `hit`.
  Pixel with_centre_ray(int column, int row, const geometry::Ray& ray, const std::optional<accel::Hit>& hit,
                        shading::Integrator& integrator) const;
  /// With more and more shadow samples, as trace(sampling) finds them, until they are good enough.
  template <class Trace>
  Pixel refined(const Trace& trace) const;
  /// Whether `target_error` allows to stop here.
  bool is_good_enough(const shading::Variance& variance) const;

  const shading::Scene& scene_;
  const Camera& camera_;
  scene::Options options_;
  int stride_, samples_per_pixel_;
  Switches switches_;
  std::vector<shading::DiscSampling> samplings_;  // ascending counts; the last is the cap
};

}  // namespace penumbra::render
