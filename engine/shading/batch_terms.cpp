#include "engine/shading/batch_terms.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/shading/batch_terms.cpp"
#include "engine/accel/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::shading::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using simd::HWY_NAMESPACE::bits;
using Doubles = hn::CappedTag<double, 8>;
using V = hn::Vec<Doubles>;

struct V3 {
  V x, y, z;
};

HWY_INLINE V3 load(const Lanes3& from, std::size_t lane) {
  const Doubles d;
  return {hn::Load(d, from.x + lane), hn::Load(d, from.y + lane), hn::Load(d, from.z + lane)};
}
HWY_INLINE V3 broadcast(const Vec3& v) {
  const Doubles d;
  return {hn::Set(d, v.x), hn::Set(d, v.y), hn::Set(d, v.z)};
}
HWY_INLINE void store(const V3& v, Lanes3& to, std::size_t lane) {
  const Doubles d;
  hn::Store(v.x, d, to.x + lane), hn::Store(v.y, d, to.y + lane), hn::Store(v.z, d, to.z + lane);
}
// In the order of math::dot and its like, and without fused operations: to the same bits.
HWY_INLINE V dot(const V3& a, const V3& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE V3 minus(const V3& a, const V3& b) { return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)}; }
HWY_INLINE V3 plus(const V3& a, const V3& b) { return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)}; }
HWY_INLINE V3 times(const V3& a, V s) { return {hn::Mul(a.x, s), hn::Mul(a.y, s), hn::Mul(a.z, s)}; }

HWY_INLINE void find_cosines(const PointBatch& points, const V3& l, std::size_t lane, LightTerms& terms) {
  const Doubles d;
  const V3 n = load(points.normal, lane);
  const V along = dot(l, n);
  hn::Store(hn::Abs(along), d, terms.diffuse + lane);
  const V3 mirrored = minus(l, times(n, hn::Mul(hn::Set(d, 2.0), along)));
  hn::Store(hn::Neg(dot(load(points.view, lane), mirrored)), d, terms.mirrored + lane);
  const V front = dot(load(points.facing, lane), l);
  terms.in_front |= LaneMask{bits(d, hn::Lt(front, hn::Zero(d)))} << lane;
}

void terms_at(const PointBatch& points, const Vec3& position, LightTerms& terms) {
  const Doubles d;
  const V3 light = broadcast(position);
  terms.facing = terms.in_front = 0;
  for (std::size_t lane = 0; lane < lane_count; lane += hn::Lanes(d)) {
    const V3 towards = minus(light, load(points.position, lane));
    store(towards, terms.towards, lane);
    terms.facing |= LaneMask{bits(d, hn::Gt(dot(load(points.facing, lane), towards), hn::Zero(d)))} << lane;
    const V squared = dot(towards, towards);
    V distance = hn::Sqrt(squared);
    // Rare: math::length takes care of what a square cannot hold.
    if (!hn::AllTrue(d, hn::And(hn::Gt(squared, hn::Set(d, 1e-280)), hn::Lt(squared, hn::Set(d, 1e280))))) {
      for (std::size_t i = 0; i < hn::Lanes(d); ++i) terms.distance[lane + i] = math::length(terms.towards[lane + i]);
      distance = hn::Load(d, terms.distance + lane);
    }
    hn::Store(distance, d, terms.distance + lane);
    const V3 l = times(towards, hn::Div(hn::Set(d, -1.0), distance));
    store(l, terms.l, lane);
    find_cosines(points, l, lane, terms);
  }
}

void terms_along(const PointBatch& points, const Vec3& along, LightTerms& terms) {
  const Doubles d;
  const V3 l = broadcast(along), towards = broadcast(-along);
  terms.facing = terms.in_front = 0;
  for (std::size_t lane = 0; lane < lane_count; lane += hn::Lanes(d)) {
    store(towards, terms.towards, lane), store(l, terms.l, lane);
    hn::Store(hn::Set(d, 1.0), d, terms.distance + lane);
    terms.facing |= LaneMask{bits(d, hn::Gt(dot(load(points.facing, lane), towards), hn::Zero(d)))} << lane;
    find_cosines(points, l, lane, terms);
  }
}

void half_axes(const Lanes3& normals, double radius, DiscBatch& disc) {  // math::frame_around
  const Doubles d;
  const V one = hn::Set(d, 1.0), r = hn::Set(d, radius);
  for (std::size_t lane = 0; lane < lane_count; lane += hn::Lanes(d)) {
    const V3 n = load(normals, lane);
    const V sign = hn::CopySign(one, n.z);
    const V a = hn::Div(hn::Set(d, -1.0), hn::Add(sign, n.z));
    const V b = hn::Mul(hn::Mul(n.x, n.y), a);
    const V3 u{hn::Add(one, hn::Mul(hn::Mul(hn::Mul(sign, n.x), n.x), a)), hn::Mul(sign, b),
               hn::Mul(hn::Neg(sign), n.x)};
    const V3 v{b, hn::Add(sign, hn::Mul(hn::Mul(n.y, n.y), a)), hn::Neg(n.y)};
    store(times(u, r), disc.u, lane), store(times(v, r), disc.v, lane);
  }
}

LaneMask above_horizon(const PointBatch& points, const DiscBatch& disc) {
  const Doubles d;
  LaneMask above = 0;
  for (std::size_t lane = 0; lane < lane_count; lane += hn::Lanes(d)) {
    const V3 facing = load(points.facing, lane);
    const V of_u = dot(facing, load(disc.u, lane)), of_v = dot(facing, load(disc.v, lane));
    const V reach = hn::Sqrt(hn::Add(hn::Mul(of_u, of_u), hn::Mul(of_v, of_v)));
    above |= LaneMask{bits(d, hn::Gt(dot(facing, load(disc.axis, lane)), reach))} << lane;
  }
  return above;
}

void ways(const DiscBatch& disc, const sampling::DiscSpirals::Points& points, Lanes3& found) {
  const Doubles d;
  for (std::size_t lane = 0; lane < lane_count; lane += hn::Lanes(d)) {
    const V x = hn::Load(d, points.x + lane), y = hn::Load(d, points.y + lane);
    store(plus(plus(load(disc.axis, lane), times(load(disc.u, lane), x)), times(load(disc.v, lane), y)), found, lane);
  }
}

}  // namespace
}  // namespace penumbra::shading::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace penumbra::shading {

HWY_EXPORT(terms_at);
HWY_EXPORT(terms_along);
HWY_EXPORT(half_axes);
HWY_EXPORT(above_horizon);
HWY_EXPORT(ways);

void find_terms(const PointBatch& points, const Vec3& position, LightTerms& terms) {
  HWY_DYNAMIC_DISPATCH(terms_at)(points, position, terms);
}
void find_terms_along(const PointBatch& points, const Vec3& l, LightTerms& terms) {
  HWY_DYNAMIC_DISPATCH(terms_along)(points, l, terms);
}
void set_half_axes(const Lanes3& normals, double radius, DiscBatch& disc) {
  HWY_DYNAMIC_DISPATCH(half_axes)(normals, radius, disc);
}
LaneMask whole_above_horizon(const PointBatch& points, const DiscBatch& disc) {
  return HWY_DYNAMIC_DISPATCH(above_horizon)(points, disc);
}
void find_ways(const DiscBatch& disc, const sampling::DiscSpirals::Points& points, Lanes3& found) {
  HWY_DYNAMIC_DISPATCH(ways)(disc, points, found);
}

}  // namespace penumbra::shading
#endif
