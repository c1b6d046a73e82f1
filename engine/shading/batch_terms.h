#pragma once
#include "engine/shading/point_batch.h"

namespace penumbra::shading {

/// What a light's share is made of at each point of a batch: the plain arithmetic, in SIMD lanes, to the same bits as
/// lit_by of one point (phong.h, disc_light.cpp).
struct LightTerms {
  Lanes3 towards;  // the middle of the light; of a distant one, unit
  Lanes3 l;        // unit, the way the light travels
  alignas(64) double distance[lane_count];
  alignas(64) double diffuse[lane_count];   // |n·l|
  alignas(64) double mirrored[lane_count];  // −v·r
  LaneMask facing = 0;                      // the light is on the viewer's side
  LaneMask in_front = 0;                    // and so is l, after rounding
};

/// Of a light at a position.
void find_terms(const PointBatch& points, const Vec3& position, LightTerms& terms);
/// Of one whose light travels along the unit `l`.
void find_terms_along(const PointBatch& points, const Vec3& l, LightTerms& terms);

/// A disc of half-axes `u` and `v` that each point sees around `axis`.
struct DiscBatch {
  Lanes3 axis, u, v;
  bool is_infinite = false;
  /// Of segments to it, in units of the way to its points.
  double limit() const { return is_infinite ? math::infinity : 1; }
};
/// Sets its half-axes, of length `radius`, across the unit normals.
void set_half_axes(const Lanes3& normals, double radius, DiscBatch& disc);
/// The lanes that have all of their discs on the viewer's side.
LaneMask whole_above_horizon(const PointBatch& points, const DiscBatch& disc);
/// The ways to a point of the disc in each lane.
void find_ways(const DiscBatch& disc, const sampling::DiscSpirals::Points& points, Lanes3& ways);

}  // namespace penumbra::shading
