#include "engine/accel/triangle_lanes.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/accel/triangle_lanes.cpp"
#include "engine/accel/simd-inl.h"
#include "engine/math/error_free.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Doubles = hn::CappedTag<double, bundle_width>;
using V = hn::Vec<Doubles>;

/// math::difference_of_products
HWY_INLINE V difference_of_products(V a, V b, V c, V e) {
#if HWY_NATIVE_FMA
  const V ce = hn::Mul(c, e);
  return hn::Add(hn::MulSub(a, b, ce), hn::NegMulAdd(c, e, ce));
#else
  const Doubles d;
  alignas(64) double rows[4][bundle_width], result[bundle_width];
  hn::Store(a, d, rows[0]), hn::Store(b, d, rows[1]), hn::Store(c, d, rows[2]), hn::Store(e, d, rows[3]);
  for (std::size_t i = 0; i < hn::Lanes(d); ++i)
    result[i] = math::difference_of_products(rows[0][i], rows[1][i], rows[2][i], rows[3][i]);
  return hn::Load(d, result);
#endif
}

void places_of(const TriangleLanes& triangles, PlaceLanes& places) {
  const Doubles d;
  for (std::size_t lane = 0; lane < bundle_width; lane += hn::Lanes(d)) {
    const auto vertex = [&](std::size_t v, std::size_t axis)
                            HWY_ATTR { return hn::Load(d, triangles.vertex[v][axis] + lane); };
    const V b1 = hn::Load(d, triangles.b1 + lane), b2 = hn::Load(d, triangles.b2 + lane);
    const V b0 = hn::Sub(hn::Sub(hn::Set(d, 1.0), b1), b2);
    V e[3], f[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const V v0 = vertex(0, axis), v1 = vertex(1, axis), v2 = vertex(2, axis);
      const V p0 = hn::Mul(v0, b0), p1 = hn::Mul(v1, b1), p2 = hn::Mul(v2, b2);
      hn::Store(hn::Add(hn::Add(p0, p1), p2), d, places.position[axis] + lane);
      const V size = hn::Add(hn::Add(hn::Add(hn::Abs(p0), hn::Abs(p1)), hn::Abs(p2)), hn::Abs(v0));
      hn::Store(hn::Mul(size, hn::Set(d, math::gamma(7))), d, places.error[axis] + lane);
      e[axis] = hn::Sub(v1, v0), f[axis] = hn::Sub(v2, v0);
    }
    const V x = difference_of_products(e[1], f[2], e[2], f[1]), y = difference_of_products(e[2], f[0], e[0], f[2]),
            z = difference_of_products(e[0], f[1], e[1], f[0]);
    const V squared = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    const V inverse = hn::Div(hn::Set(d, 1.0), hn::Sqrt(squared));
    hn::Store(hn::Mul(x, inverse), d, places.normal[0] + lane);
    hn::Store(hn::Mul(y, inverse), d, places.normal[1] + lane);
    hn::Store(hn::Mul(z, inverse), d, places.normal[2] + lane);
    // Rare: math::normalize takes care of what a square cannot hold, and of none at all.
    if (hn::AllTrue(d, hn::And(hn::Gt(squared, hn::Set(d, 1e-280)), hn::Lt(squared, hn::Set(d, 1e280))))) continue;
    alignas(64) double rows[3][bundle_width];
    hn::Store(x, d, rows[0]), hn::Store(y, d, rows[1]), hn::Store(z, d, rows[2]);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      const math::Vec3 n = math::normalize_or({rows[0][i], rows[1][i], rows[2][i]}, {});
      for (int axis = 0; axis < 3; ++axis) places.normal[axis][lane + i] = n[axis];
    }
  }
}

}  // namespace
}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace penumbra::accel {

HWY_EXPORT(places_of);

void find_places(const TriangleLanes& triangles, PlaceLanes& places) {
  HWY_DYNAMIC_DISPATCH(places_of)(triangles, places);
}

}  // namespace penumbra::accel
#endif
