// Compiled once per instruction set, with the file that includes it.
#if defined(PENUMBRA_ACCEL_RAY_BUNDLE) == defined(HWY_TARGET_TOGGLE)
#ifdef PENUMBRA_ACCEL_RAY_BUNDLE
#undef PENUMBRA_ACCEL_RAY_BUNDLE
#else
#define PENUMBRA_ACCEL_RAY_BUNDLE
#endif

#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "engine/accel/bundle.h"
#include "engine/accel/ray_tests-inl.h"
#include "engine/math/constants.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using simd::HWY_NAMESPACE::bits;

/// Rays side by side, lane by lane what FloatRay has. All lanes are filled: those without a ray of their own, whose
/// limit nothing is before, with what does no harm.
struct FloatBundle {
  const std::size_t *near_row = nullptr, *far_row = nullptr;  // of those that walk together
  alignas(64) float near_inverse[3][bundle_width], near_offset[3][bundle_width];
  alignas(64) float far_inverse[3][bundle_width], far_offset[3][bundle_width], limit[bundle_width];
  alignas(64) float origin[3][bundle_width], shear[3][bundle_width], error[bundle_width];
  alignas(64) float direction[3][bundle_width], t_of_length[bundle_width];  // where there are spheres
  std::uint8_t octant[bundle_width], main_axis[bundle_width];
  FloatRay rays[bundle_width];  // each alone

  FloatBundle(const WideTree& tree, const Bundle& bundle) {
    const Doubles d;
    unsigned far = 0;
    for (std::size_t lane = 0; lane < bundle_width; lane += hn::Lanes(d)) far |= prepare(tree, bundle, lane) << lane;
    far &= (1u << bundle.size()) - 1;
    for (std::size_t i = 0; i < bundle.size(); ++i) {
      if ((far >> i & 1u) != 0) {
        rays[i] = FloatRay(tree, bundle.prepared(i));
        set_for_boxes(i);
      } else {
        fill(i, tree);
      }
    }
    for (std::size_t i = bundle.size(); i < bundle_width; ++i) limit[i] = -1, octant[i] = 0;
  }

 private:
  using Doubles = hn::CappedTag<double, bundle_width>;
  using Halves = hn::Rebind<float, Doubles>;

  /// The lanes from one on; returns which rays are too far away, or too fast or slow, to be prepared this way.
  HWY_INLINE unsigned prepare(const WideTree& tree, const Bundle& bundle, std::size_t lane) {
    const Doubles d;
    const Halves f;
    const auto row = [&](const double* values) HWY_ATTR { return hn::Load(d, values + lane); };
    const auto x = row(bundle.directions(0)), y = row(bundle.directions(1)), z = row(bundle.directions(2));
    const auto size_x = hn::Abs(x), size_y = hn::Abs(y), size_z = hn::Abs(z);
    // As geometry::PreparedRay.
    const auto is_x = hn::And(hn::Gt(size_x, size_y), hn::Gt(size_x, size_z));
    const auto is_y = hn::AndNot(hn::Gt(size_x, size_y), hn::Gt(size_y, size_z));
    const auto of_main = [&](auto if_x, auto if_y, auto if_z)
                             HWY_ATTR { return hn::IfThenElse(is_x, if_x, hn::IfThenElse(is_y, if_y, if_z)); };
    const auto one = hn::Set(d, 1.0);
    const auto inverse_x = hn::Div(one, x), inverse_y = hn::Div(one, y), inverse_z = hn::Div(one, z);
    const auto shear_z = of_main(inverse_x, inverse_y, inverse_z);
    const auto shear_x = hn::Mul(of_main(y, z, x), shear_z), shear_y = hn::Mul(of_main(z, x, y), shear_z);
    const auto from_x = hn::Sub(row(bundle.origins(0)), hn::Set(d, tree.origin().x)),
               from_y = hn::Sub(row(bundle.origins(1)), hn::Set(d, tree.origin().y)),
               from_z = hn::Sub(row(bundle.origins(2)), hn::Set(d, tree.origin().z));
    const auto distance = hn::Max(hn::Max(hn::Abs(from_x), hn::Abs(from_y)), hn::Abs(from_z));
    const auto size = hn::Add(hn::Set(d, tree.reach()), distance);
    const auto slowest = hn::Abs(shear_z), product = hn::Mul(slowest, size);
    const auto most = hn::Set(d, largest_in_range), least = hn::Set(d, smallest_in_range);
    const auto is_fine = hn::And(hn::And(hn::Lt(slowest, most), hn::Lt(product, most)),
                                 hn::And(hn::And(hn::Gt(slowest, least), hn::Gt(product, least)),
                                         hn::Le(distance, hn::Set(d, 8 * tree.reach()))));
    const auto store = [&](auto value, float* values) HWY_ATTR { hn::Store(hn::DemoteTo(f, value), f, values + lane); };
    store(hn::Mul(hn::Set(d, errors_of_size), size), error);
    store(shear_x, shear[0]), store(shear_y, shear[1]), store(shear_z, shear[2]);
    const auto fastest = hn::DemoteTo(f, hn::Mul(hn::Set(d, fastest_inverse), slowest)),
               widening = hn::DemoteTo(f, hn::Mul(hn::Set(d, least_widening), size));
    unsigned backwards[3];
    const auto prepare_axis = [&](std::size_t axis, auto from, auto exact_inverse) HWY_ATTR {
      const auto at = hn::DemoteTo(f, from);
      const auto inverse = hn::Min(hn::Max(hn::DemoteTo(f, exact_inverse), hn::Neg(fastest)), fastest);
      set_axis(axis, lane, at, inverse, widening);
      backwards[axis] = bits(f, hn::Lt(inverse, hn::Zero(f)));
    };
    prepare_axis(0, from_x, inverse_x), prepare_axis(1, from_y, inverse_y), prepare_axis(2, from_z, inverse_z);
    const unsigned main_x = bits(d, is_x), main_y = bits(d, is_y);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      octant[lane + i] = static_cast<std::uint8_t>((backwards[0] >> i & 1u) | (backwards[1] >> i & 1u) << 1 |
                                                   (backwards[2] >> i & 1u) << 2);
      main_axis[lane + i] = static_cast<std::uint8_t>((main_x >> i & 1u) != 0 ? 0 : (main_y >> i & 1u) != 0 ? 1 : 2);
    }
    return ~bits(d, is_fine) | (tree.sphere_blocks().empty() ? 0 : prepare_for_spheres(bundle, lane));
  }

  /// The same of what tests of spheres need; returns the rays of a length that no square holds.
  HWY_INLINE unsigned prepare_for_spheres(const Bundle& bundle, std::size_t lane) {
    const Doubles d;
    const Halves f;
    hn::Vec<Doubles> along[3], squared = hn::Zero(d);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      along[axis] = hn::Load(d, bundle.directions(axis) + lane);
      squared = hn::MulAdd(along[axis], along[axis], squared);
    }
    const auto inverse_speed = hn::Div(hn::Set(d, 1.0), hn::Sqrt(squared));
    hn::Store(hn::DemoteTo(f, inverse_speed), f, t_of_length + lane);
    for (std::size_t axis = 0; axis < 3; ++axis)
      hn::Store(hn::DemoteTo(f, hn::Mul(along[axis], inverse_speed)), f, direction[axis] + lane);
    return ~bits(d, hn::And(hn::Gt(squared, hn::Set(d, 1e-280)), hn::Lt(squared, hn::Set(d, 1e280))));
  }

  /// As FloatRay::prepare_for_boxes.
  template <class Floats>
  HWY_INLINE void set_axis(std::size_t axis, std::size_t lane, Floats at, Floats inverse, Floats least) {
    const Halves f;
    const auto widening = hn::CopySign(hn::MulAdd(hn::Abs(at), hn::Set(f, 7 * roundoff), least), inverse);
    const auto near = hn::Mul(inverse, hn::Set(f, 1 - slack)), far = hn::Mul(inverse, hn::Set(f, 1 + slack));
    hn::Store(at, f, origin[axis] + lane);
    hn::Store(near, f, near_inverse[axis] + lane), hn::Store(far, f, far_inverse[axis] + lane);
    hn::Store(hn::Neg(hn::Mul(hn::Add(at, widening), near)), f, near_offset[axis] + lane);
    hn::Store(hn::Neg(hn::Mul(hn::Sub(at, widening), far)), f, far_offset[axis] + lane);
  }

  void fill(std::size_t i, const WideTree& tree) {
    FloatRay& ray = rays[i];
    ray.near_row = rows_of_octant(octant[i]), ray.far_row = rows_of_octant(~unsigned{octant[i]});
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ray.near_inverse[axis] = near_inverse[axis][i], ray.near_offset[axis] = near_offset[axis][i];
      ray.far_inverse[axis] = far_inverse[axis][i], ray.far_offset[axis] = far_offset[axis][i];
      ray.origin[axis] = origin[axis][i];
    }
    ray.axis[2] = main_axis[i];
    ray.axis[0] = ray.axis[2] == 2 ? 0 : ray.axis[2] + 1;
    ray.axis[1] = ray.axis[0] == 2 ? 0 : ray.axis[0] + 1;
    ray.shear_x = shear[0][i], ray.shear_y = shear[1][i], ray.shear_z = shear[2][i];
    ray.error = error[i], ray.t_error = error[i] * std::fabs(shear[2][i]);
    ray.t_start = 0;
    if (tree.sphere_blocks().empty()) return;
    ray.t_of_length = t_of_length[i];
    for (std::size_t axis = 0; axis < 3; ++axis) ray.direction[axis] = direction[axis][i];
  }
  void set_for_boxes(std::size_t i) {
    const FloatRay& ray = rays[i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      near_inverse[axis][i] = ray.near_inverse[axis], near_offset[axis][i] = ray.near_offset[axis];
      far_inverse[axis][i] = ray.far_inverse[axis], far_offset[axis][i] = ray.far_offset[axis];
    }
    for (unsigned o = 0; o < 8; ++o)
      octant[i] = rows_of_octant(o) == ray.near_row ? static_cast<std::uint8_t>(o) : octant[i];
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

/// Calls use(rays), one bit each, for those of each octant, with the bundle ready for them.
template <class Use>
HWY_INLINE void for_each_octant(FloatBundle& bundle, std::size_t count, const Use& use) {
  unsigned waiting = (1u << count) - 1;
  while (waiting != 0) {
    const unsigned octant = bundle.octant[std::countr_zero(waiting)];
    bundle.near_row = rows_of_octant(octant), bundle.far_row = rows_of_octant(~octant);
    unsigned alike = 0;
    for (std::size_t i = 0; i < bundle_width; ++i) alike |= bundle.octant[i] == octant ? 1u << i : 0;
    alike &= waiting;
    use(alike);
    waiting &= ~alike;
  }
}

/// What `of_ray` makes of each ray of a bundle.
template <class OfRay>
HWY_INLINE auto for_each_ray(const OfRay& of_ray) {
  return [&]<std::size_t... lane>(std::index_sequence<lane...>) HWY_ATTR { return std::array{of_ray(lane)...}; }
  (std::make_index_sequence<bundle_width>());
}

}  // namespace
}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
