#pragma once
#include "engine/shading/batch_terms.h"
#include "engine/shading/lights/light.h"

namespace penumbra::shading {

/// What a batch of points would send to the viewer of a light that nothing hides, and then how much of it they see.
class BatchShares {
 public:
  BatchShares(const BatchLighting& lighting, const LightTerms& terms);

  /// The lanes whose share is to be found.
  LaneMask lit() const { return lit_; }
  /// What the surface sends on of light that travels along l: lobe_towards, from the terms.
  Color lobe(std::size_t lane) const;
  void set(std::size_t lane, const Color& share) { shares_[lane] = share; }

  struct Seen {
    shadows::Target target;
    double radius;  // of the disc; 0: a point
    LightName name;
  };
  /// Adds to the sums what is seen of the light.
  void add_visible(const Seen& seen);

 private:
  void add_visible(const Seen& seen, LaneMask lanes);

  const BatchLighting& lighting_;
  const LightTerms& terms_;
  LaneMask lit_;
  std::array<Color, lane_count> shares_;
};

}  // namespace penumbra::shading
