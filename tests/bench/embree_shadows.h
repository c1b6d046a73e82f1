#pragma once
#include <cmath>
#include <optional>

#include "tests/bench/area_kernels.h"
#include "tests/bench/embree_scene.h"
#include "tests/bench/surface_hit.h"

namespace penumbra::bench {

using math::Color;

/// Embree's answer for one ray, with the position taken from the shape in double.
std::optional<SurfaceHit> closest_with_embree(const EmbreeScene& embree, const FlatScene& flat, const Vec3& origin,
                                              const Vec3& direction);

/// Beside the surface, on the side of `towards`: the least, in powers of two of the largest coordinate that takes part,
/// that keeps every bench scene free of acne.
Vec3 off_surface(const SurfaceHit& hit, const Vec3& towards);

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
  Color sum;              // of the transmittances, weighed
  bool is_mixed = false;  // not all samples agree
};

/// Sums the transmittance over the `count` samples (x[i], y[i]) of the unit disc, in packets of `width` = 1, 8 or 16.
ShadowSum cast_shadow_rays(const EmbreeScene& embree, const DiscTarget& target, const float* x, const float* y,
                           int count, int width);
/// Sums transmittance · cosine over rays `first` to `last` from `origin` to an area light; those of cosine 0 are not
/// cast.
ShadowSum cast_shadow_rays(const EmbreeScene& embree, const Vec3& origin, const RayLanes& rays, int first, int last,
                           int width);

}  // namespace penumbra::bench
