#pragma once
#include "tests/bench/contract_image.h"
#include "tests/bench/embree_scene.h"

namespace penumbra::bench {

/// Embree's answer for one ray, with the position taken from the shape in double.
std::optional<SurfaceHit> closest_with_embree(const EmbreeScene& embree, const FlatScene& flat, const Vec3& origin,
                                              const Vec3& direction);

/// Beside the surface, on the side of `towards`.
Vec3 off_surface(const EmbreeScene& embree, const SurfaceHit& hit, const Vec3& towards);

/// A disc of light as the lit point sees it: its center is at origin + axis.
struct DiscTarget {
  Vec3 origin, axis, u, v;

  /// The disc turned around its center by this share of a circle.
  DiscTarget turned(float share) const {
    const double angle = 2 * M_PI * static_cast<double>(share);
    const double c = std::cos(angle), s = std::sin(angle);
    return {origin, axis, u * c + v * s, v * c - u * s};
  }
};

struct ShadowSum {
  Color sum;              // of the transmittances
  bool is_mixed = false;  // not all samples agree
};

/// Sums the transmittance over the `count` samples (x[i], y[i]) of the unit disc, in packets of `width` = 1, 8 or 16.
ShadowSum cast_shadow_rays(const EmbreeScene& embree, const DiscTarget& target, const float* x, const float* y,
                           int count, int width);

}  // namespace penumbra::bench
