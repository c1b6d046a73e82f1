// Compiled once per instruction set, with the file that includes it.
#if defined(PENUMBRA_ACCEL_RAY_BUNDLE) == defined(HWY_TARGET_TOGGLE)
#ifdef PENUMBRA_ACCEL_RAY_BUNDLE
#undef PENUMBRA_ACCEL_RAY_BUNDLE
#else
#define PENUMBRA_ACCEL_RAY_BUNDLE
#endif

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "engine/accel/ray_tests-inl.h"
#include "engine/math/constants.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using simd::HWY_NAMESPACE::bits;

/// Rays side by side that go into the same octant, for boxes: lane by lane what FloatRay has.
struct FloatBundle {
  const std::size_t *near_row, *far_row;
  alignas(64) float near_inverse[3][bundle_width], near_offset[3][bundle_width];
  alignas(64) float far_inverse[3][bundle_width], far_offset[3][bundle_width], limit[bundle_width];

  void set(std::size_t lane, const FloatRay& ray, float ray_limit) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      near_inverse[axis][lane] = ray.near_inverse[axis], near_offset[axis][lane] = ray.near_offset[axis];
      far_inverse[axis][lane] = ray.far_inverse[axis], far_offset[axis][lane] = ray.far_offset[axis];
    }
    limit[lane] = ray_limit;
  }
};

/// Which rays enter a child, one bit each; and before which t none does, if it is asked for.
template <bool tells_where>
HWY_INLINE unsigned enter(const WideTree::Node& node, std::size_t child, const FloatBundle& bundle, float* nearest) {
  const Floats d;
  const float* planes = &node.bounds[0][0] + child;
  unsigned entered = 0;
  auto first = hn::Set(d, math::float_infinity);
  for (std::size_t lane = 0; lane < bundle_width; lane += hn::Lanes(d)) {
    const auto near_at = [&](std::size_t axis) HWY_ATTR {
      return hn::MulAdd(hn::Set(d, planes[bundle.near_row[axis]]), hn::Load(d, bundle.near_inverse[axis] + lane),
                        hn::Load(d, bundle.near_offset[axis] + lane));
    };
    const auto far_at = [&](std::size_t axis) HWY_ATTR {
      return hn::MulAdd(hn::Set(d, planes[bundle.far_row[axis]]), hn::Load(d, bundle.far_inverse[axis] + lane),
                        hn::Load(d, bundle.far_offset[axis] + lane));
    };
    const auto near = hn::Max(hn::Max(near_at(0), near_at(1)), hn::Max(near_at(2), hn::Zero(d)));
    const auto far = hn::Min(hn::Min(far_at(0), far_at(1)), hn::Min(far_at(2), hn::Load(d, bundle.limit + lane)));
    const auto is_entered = hn::Le(near, far);
    entered |= bits(d, is_entered) << lane;
    if constexpr (tells_where) first = hn::Min(first, hn::IfThenElse(is_entered, near, first));
  }
  if constexpr (tells_where) *nearest = hn::GetLane(hn::MinOfLanes(d, first));
  return entered;
}

/// What `of_ray` makes of each of `count` rays, as often as the last lanes need it.
template <class OfRay>
HWY_INLINE auto for_each_lane(std::size_t count, const OfRay& of_ray) {
  return [&]<std::size_t... lane>(std::index_sequence<lane...>) HWY_ATTR {
    return std::array{of_ray(std::min(lane, count - 1))...};
  }
  (std::make_index_sequence<bundle_width>());
}

/// Calls use(rays), one bit each, for those of each octant, with the bundle ready for them.
template <class Use>
HWY_INLINE void for_each_octant(const std::array<FloatRay, bundle_width>& rays, std::size_t count, FloatBundle& bundle,
                                const Use& use) {
  unsigned waiting = (1u << count) - 1;
  while (waiting != 0) {
    const FloatRay& first = rays[static_cast<std::size_t>(std::countr_zero(waiting))];
    bundle.near_row = first.near_row, bundle.far_row = first.far_row;
    unsigned alike = 0;
    for (std::size_t i = 0; i < count; ++i) alike |= rays[i].near_row == first.near_row ? 1u << i : 0;
    alike &= waiting;
    use(alike);
    waiting &= ~alike;
  }
}

}  // namespace
}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
