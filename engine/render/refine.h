#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "engine/render/camera.h"
#include "engine/render/canvas.h"
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
               const shading::Switches& switches);

  struct Pixel {
    math::Color color;
    double squared_error = 0;  // estimated, summed over the channels; 0 where clamping hides it
  };
  /// Depends on seed, pixel and pass alone.
  Pixel sample(int column, int row, shading::Integrator& integrator) const;

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
  Pixel sample_one(int column, int row, shading::Integrator& integrator) const;
  Pixel with_one_camera_ray(int column, int row, shading::Integrator& integrator) const;
  /// Whether `target_error` allows to stop here.
  bool is_good_enough(const shading::Variance& variance) const;

  const shading::Scene& scene_;
  const Camera& camera_;
  scene::Options options_;
  int stride_, samples_per_pixel_;
  shading::Switches switches_;
  std::vector<shading::DiscSampling> samplings_;  // ascending counts; the last is the cap
};

}  // namespace penumbra::render
