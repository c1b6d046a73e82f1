#pragma once
#include <vector>

#include "tests/bench/area_kernels.h"
#include "tests/bench/contract_lights.h"
#include "tests/bench/sample_patterns.h"
#include "tests/bench/surface_hit.h"

namespace penumbra::bench {

/// Rays from a point to an area light, uniform over the solid angle it fills.
class AreaRays {
 public:
  /// Where they start and what they light.
  struct Lit {
    Vec3 origin, facing, shading_normal;
  };

  /// Spheres take their points from `discs`, rectangles from `squares`. Both outlive this.
  AreaRays(const PointPatterns& discs, const PointPatterns& squares);

  /// Aims at the light with the points of `set`, turned or shifted by numbers of `random`. False when the light is
  /// behind the surface or shines the other way.
  bool aim(const AreaLight& light, const Lit& lit, std::uint32_t set, Random& random);

  double solid_angle() const { return solid_angle_; }
  RayLanes lanes() { return {x_.data(), y_.data(), z_.data(), cosine_.data(), discs_.samples()}; }

 private:
  bool start(const scene::RectangleLight& light, const Lit& lit, std::uint32_t set, Random& random);
  bool start(const scene::SphereLight& light, const Lit& lit, std::uint32_t set, Random& random);

  const PointPatterns &discs_, &squares_;
  double solid_angle_ = 0;
  std::vector<float> x_, y_, z_, cosine_;
};

}  // namespace penumbra::bench
