// Compiled once per instruction set, with the file that includes it.
#if defined(PENUMBRA_ACCEL_FLOAT_RAY) == defined(HWY_TARGET_TOGGLE)
#ifdef PENUMBRA_ACCEL_FLOAT_RAY
#undef PENUMBRA_ACCEL_FLOAT_RAY
#else
#define PENUMBRA_ACCEL_FLOAT_RAY
#endif

#include <hwy/highway.h>

#include <bit>
#include <cmath>
#include <limits>

#include "engine/accel/wide_tree.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr float roundoff = 0x1p-24F;

/// A ray in single precision, relative to a tree's origin.
struct FloatRay {
  // For boxes, by axis: where in Node::bounds the planes met first and last are; the origin and reciprocal to use with
  // each. Roundings go the way that makes a box larger.
  std::size_t near_row[3], far_row[3];
  HWY_ALIGN float near_origin[4], far_origin[4], near_inverse[4], far_inverse[4];
  // For triangles: the shear of geometry::PreparedRay, and the largest error of a sheared coordinate.
  int axis[3];
  HWY_ALIGN float origin[4];
  float shear_x, shear_y, shear_z, error, t_error;
  // For spheres: unit direction, and units of t in a unit of length.
  float direction[3], t_of_length;
  double t_start = 0;  // the origin is that far along the ray: near the tree, where single precision is fine enough

  FloatRay(const WideTree& tree, const geometry::PreparedRay& ray) {
    Vec3 from = ray.origin - tree.origin();
    double distance = math::max_component(math::abs(from));
    if (distance > 8 * tree.reach()) {
      start_near(tree, ray, from);
      distance = math::max_component(math::abs(from));
    }
    // Vertex and origin are off by a rounding each, their difference by one more, the shear by three: at most 8 in all,
    // of coordinates below reach + distance (|shear| ≤ 1).
    error = static_cast<float>(8.5 * 0x1p-24 * (tree.reach() + distance));
    // Of a start away from the ray's origin, by the double operations that moved it.
    const float moved = t_start > 0 ? error * 0x1p-16F : 0;
    constexpr float slack = 10 * roundoff;  // of the slab test's operations, and of the shapes' own tests
    HWY_ALIGN const float inverse[4]{static_cast<float>(ray.inverse.x), static_cast<float>(ray.inverse.y),
                                     static_cast<float>(ray.inverse.z), 0};
    origin[0] = static_cast<float>(from.x), origin[1] = static_cast<float>(from.y);
    origin[2] = static_cast<float>(from.z), origin[3] = 0;
    const hn::CappedTag<float, 4> d;
    for (std::size_t i = 0; i < 4; i += hn::Lanes(d)) {
      const auto o = hn::Load(d, origin + i), reciprocal = hn::Load(d, inverse + i);
      const auto rounding =
          hn::MulAdd(hn::Abs(o), hn::Set(d, 2.5F * roundoff), hn::Set(d, std::numeric_limits<float>::min() + moved));
      const auto outward = hn::CopySign(rounding, reciprocal);
      hn::Store(hn::Add(o, outward), d, near_origin + i);
      hn::Store(hn::Sub(o, outward), d, far_origin + i);
      hn::Store(hn::Mul(reciprocal, hn::Set(d, 1 - slack)), d, near_inverse + i);
      hn::Store(hn::Mul(reciprocal, hn::Set(d, 1 + slack)), d, far_inverse + i);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t backwards = (std::bit_cast<std::uint32_t>(inverse[i]) >> 31) * 3 * WideTree::width;
      near_row[i] = i * WideTree::width + backwards;
      far_row[i] = (i + 3) * WideTree::width - backwards;
    }
    axis[0] = ray.axis_x, axis[1] = ray.axis_y, axis[2] = ray.axis_z;
    shear_x = static_cast<float>(ray.shear_x), shear_y = static_cast<float>(ray.shear_y);
    shear_z = static_cast<float>(ray.shear_z);
    // A plane towards which the ray does not move in single precision decides nothing.
    if (!std::isfinite(shear_z)) shear_z = std::numeric_limits<float>::quiet_NaN();
    t_error = error * std::fabs(shear_z);
    if (tree.sphere_blocks().empty()) return;
    const double inverse_speed = 1 / math::length(ray.direction);
    t_of_length = static_cast<float>(inverse_speed);
    for (int i = 0; i < 3; ++i) direction[i] = static_cast<float>(ray.direction[i] * inverse_speed);
  }

  float limit(double t) const { return rounded_up(t - t_start); }

 private:
  void start_near(const WideTree& tree, const geometry::PreparedRay& ray, Vec3& from) {
    const double speed = math::length(ray.direction);
    const double t = (math::length(from) - 4 * tree.reach()) / speed;
    const Vec3 moved = from + ray.direction * t;
    if (!(t > 0) || !math::is_finite(moved)) return;
    t_start = t;
    from = moved;
  }
};

}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
