#pragma once
#include <functional>
#include <span>
#include <vector>

#include "engine/render/canvas.h"
#include "engine/render/pixel_rays.h"

namespace penumbra::render {

/// Takes as many camera samples of each pixel of a tile as a target for their error asks for. A pixel alone cannot tell
/// its error well: that few samples agree may be chance. So a model tells how the pixels' variances compare, and the
/// whole tile by what factor that model is off in it. And what has a say in the decision to stop no longer tells the
/// error honestly – pixels stop where it happens to be small –, so the error of each is measured by what had none: the
/// decision is to take as many again, which then show how far both are off. (Of one camera ray a pixel:
/// sample_choice.h.) May be shared between threads while it refines.
class TileRefiner {
 public:
  /// The numbers of samples are caps. `rays` outlives this object.
  TileRefiner(const PixelRays& rays, double target_error, int samples_per_pixel, int shadow_samples);

  /// The tile's pixels, row by row; left unfinished once `is_stopped`.
  std::vector<Pixel> refine(const Canvas::Tile& tile, const std::function<bool()>& is_stopped,
                            shading::Integrator& integrator) const;

 private:
  struct Several;
  class Surroundings;
  /// What the pixels of a tile have in common after as many samples.
  struct Trend {
    sampling::Halves::Order order;
    double of_spread;  // the variance of a mean of samples that vary by 1
    double gain;       // what twice the samples divide it by
  };
  Trend trend_of(const std::vector<Several>& active) const;
  /// Which of them are to end with the next look.
  void decide(std::vector<Several>& active, const Trend& trend, const Surroundings& around,
              const shading::DiscSampling& sampling, shading::Integrator& integrator) const;
  /// How different is what is seen beside the pixel, squared.
  double contrast_beside(Several& pixel, const shading::DiscSampling& sampling, shading::Integrator& integrator) const;

  const PixelRays& rays_;
  double squared_target_;                         // of a pixel
  std::vector<int> looks_;                        // numbers of camera samples, ascending; the last is the cap
  std::vector<shading::DiscSampling> samplings_;  // ascending counts; the last is the cap
};

}  // namespace penumbra::render
