#pragma once
#include <embree3/rtcore.h>

#include "tests/bench/contract_image.h"

namespace penumbra::bench {

/// The closest hit in double precision: Embree finds the boxes, the shapes are met by textbook formulas. For reference
/// images, in which a pixel on the wrong side of an edge would count more than all noise.
class ExactHits {
 public:
  explicit ExactHits(const FlatScene& flat);
  ~ExactHits();
  ExactHits(const ExactHits&) = delete;
  ExactHits& operator=(const ExactHits&) = delete;

  /// `from` is the surface the ray leaves, if any: it is not met within `least` of the origin.
  std::optional<SurfaceHit> closest(const Vec3& origin, const Vec3& direction, double least) const;

 private:
  const FlatScene& flat_;
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace penumbra::bench
