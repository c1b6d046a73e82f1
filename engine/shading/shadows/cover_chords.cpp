#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/shading/shadows/cover_chords.cpp"
#include "engine/accel/simd-inl.h"

#include "engine/shading/shadows/cover_chords.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::shading::shadows::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// Along the chord the ellipse is where a·t² + 2b·t + c ≥ 0: between the roots, as a < 0.
template <class V>
HWY_INLINE void clip_to_ellipse(const Quadratic& q, V offset, V& begin, V& end) {
  const hn::DFromV<V> d;
  const auto set = [&](double x) HWY_ATTR { return hn::Set(d, x); };
  const V a = set(q.f), b = hn::Add(set(q.c), hn::Mul(set(q.e), offset)),
          c = hn::Add(set(q.a), hn::Mul(hn::Add(set(2 * q.b), hn::Mul(set(q.d), offset)), offset));
  const V discriminant = hn::Sub(hn::Mul(b, b), hn::Mul(a, c));
  const auto has_roots = hn::Gt(discriminant, hn::Zero(d));
  const V sum = hn::Neg(hn::Add(b, hn::CopySign(hn::Sqrt(hn::Max(discriminant, hn::Zero(d))), b)));
  const V one = hn::Mul(sum, set(1 / q.f)),
          other = hn::IfThenElse(hn::Eq(sum, hn::Zero(d)), hn::Neg(one), hn::Div(c, sum));
  end = hn::IfThenElse(has_roots, hn::Min(end, hn::Max(one, other)), begin);
  begin = hn::IfThenElse(has_roots, hn::Max(begin, hn::Min(one, other)), begin);
}

// Products and sums one by one: the same bits on every processor.
template <class D>
HWY_INLINE void clip_lanes(D d, std::size_t k, std::span<const Linear> edges, const Quadratic* ellipse,
                           const ChordLanes& chords, const HiddenLanes& hidden) {
  using V = hn::Vec<D>;
  const V offset = hn::LoadU(d, chords.offset + k);
  V from = hn::LoadU(d, chords.begin + k), to = hn::LoadU(d, chords.end + k);
  for (const Linear& edge : edges) {
    const V value = hn::Add(hn::Set(d, edge.a), hn::Mul(hn::Set(d, edge.b), offset));
    const V place = hn::Div(hn::Neg(value), hn::Set(d, edge.c));
    if (edge.c > 0) {
      from = hn::Max(from, place);
    } else if (edge.c < 0) {
      to = hn::Min(to, place);
    } else {
      to = hn::IfThenElse(hn::Lt(value, hn::Zero(d)), from, to);
    }
  }
  if (ellipse != nullptr) clip_to_ellipse(*ellipse, offset, from, to);
  hn::StoreU(from, d, hidden.begin + k), hn::StoreU(to, d, hidden.end + k);
  std::uint8_t bytes[8]{};
  hn::StoreMaskBits(d, hn::Lt(from, to), bytes);
  hidden.hits[k / 8] =
      static_cast<std::uint8_t>((k % 8 == 0 ? 0u : hidden.hits[k / 8]) | unsigned{bytes[0]} << (k % 8));
}

void clip_chords(std::span<const Linear> edges, const Quadratic* ellipse, const ChordLanes& chords,
                 const HiddenLanes& hidden) {
  const hn::CappedTag<double, 8> wide;
  std::size_t k = 0;
  for (; k + hn::Lanes(wide) <= chords.count; k += hn::Lanes(wide)) clip_lanes(wide, k, edges, ellipse, chords, hidden);
  const hn::CappedTag<double, 4> narrow;
  for (; k < chords.count; k += hn::Lanes(narrow)) clip_lanes(narrow, k, edges, ellipse, chords, hidden);
}

}  // namespace
}  // namespace penumbra::shading::shadows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace penumbra::shading::shadows {

HWY_EXPORT(clip_chords);

void clip_to_cover(std::span<const Linear> edges, const Quadratic* ellipse, const ChordLanes& chords,
                   const HiddenLanes& hidden) {
  HWY_DYNAMIC_DISPATCH(clip_chords)(edges, ellipse, chords, hidden);
}

}  // namespace penumbra::shading::shadows
#endif
