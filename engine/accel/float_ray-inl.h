// Compiled once per instruction set, with the file that includes it.
#if defined(PENUMBRA_ACCEL_FLOAT_RAY) == defined(HWY_TARGET_TOGGLE)
#ifdef PENUMBRA_ACCEL_FLOAT_RAY
#undef PENUMBRA_ACCEL_FLOAT_RAY
#else
#define PENUMBRA_ACCEL_FLOAT_RAY
#endif

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/accel/simd-inl.h"
#include "engine/accel/wide_tree.h"
#include "engine/math/constants.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr float roundoff = 0x1p-24F;

/// Of everything that is done to a ray's origin relative to a tree, and to the tree's coordinates, which are below
/// `size` as is the origin's distance: vertex and origin are off by a rounding each, their difference by one more, the
/// shear by three: at most 8 in all (|shear| ≤ 1).
constexpr double errors_of_size = 8.5 * 0x1p-24;
/// A ray that hardly moves along an axis is taken for one that moves 2^-40 times as fast as along its main axis: until
/// it has left the tree that is off by less than `least_widening` of the size, and in a slab that wide it stays as long
/// as that.
constexpr double fastest_inverse = 0x1p40, least_widening = 0x1p-37;
constexpr float slack = 12 * roundoff;  // of the slab test's last operations, and of the shapes' own tests
/// Where t or a product with it would leave the range of single precision, nothing is decided in it.
constexpr double largest_in_range = 0x1p80, smallest_in_range = 0x1p-100;

/// Where in Node::bounds the planes are that a ray into an octant meets first; those it meets last are the ones of the
/// opposite octant.
inline const std::size_t* rows_of_octant(unsigned octant) {
  constexpr std::size_t w = WideTree::width;
  static constexpr std::size_t lower[8][3]{{0, w, 2 * w}, {3 * w, w, 2 * w}, {0, 4 * w, 2 * w}, {3 * w, 4 * w, 2 * w},
                                           {0, w, 5 * w}, {3 * w, w, 5 * w}, {0, 4 * w, 5 * w}, {3 * w, 4 * w, 5 * w}};
  return lower[octant & 7u];
}

/// A ray in single precision, relative to a tree's origin.
struct FloatRay {
  // For boxes, by axis: where in Node::bounds the planes met first and last are, and what a plane is multiplied by and
  // has added to become a t. Roundings go the way that makes a box larger.
  const std::size_t *near_row, *far_row;
  HWY_ALIGN float near_inverse[4], near_offset[4], far_inverse[4], far_offset[4];
  // For triangles: the shear of geometry::PreparedRay, and the largest error of a sheared coordinate.
  int axis[3];
  HWY_ALIGN float origin[4];
  float shear_x, shear_y, shear_z, error, t_error;
  // For spheres: unit direction, and units of t in a unit of length.
  float direction[3], t_of_length;
  double t_start = 0;  // the origin is that far along the ray: near the tree, where single precision is fine enough

  FloatRay() = default;  ///< To be filled.
  FloatRay(const WideTree& tree, const geometry::PreparedRay& ray) {
    Vec3 from = ray.origin - tree.origin();
    double distance = math::max_component(math::abs(from));
    if (distance > 8 * tree.reach()) {
      start_near(tree, ray, from);
      distance = math::max_component(math::abs(from));
    }
    const double size = tree.reach() + distance, slowest = std::fabs(ray.shear_z);
    error = static_cast<float>(errors_of_size * size);
    const bool is_in_range = slowest < largest_in_range && slowest * size < largest_in_range &&
                             slowest > smallest_in_range && slowest * size > smallest_in_range;
    prepare_for_boxes(ray, from, size, is_in_range);
    axis[0] = ray.axis_x, axis[1] = ray.axis_y, axis[2] = ray.axis_z;
    shear_x = static_cast<float>(ray.shear_x), shear_y = static_cast<float>(ray.shear_y);
    shear_z = static_cast<float>(ray.shear_z);
    if (!is_in_range) shear_z = math::float_nan;
    t_error = error * std::fabs(shear_z);
    if (tree.sphere_blocks().empty()) return;
    const double inverse_speed = 1 / math::length(ray.direction);
    t_of_length = is_in_range ? static_cast<float>(inverse_speed) : 0;
    for (int i = 0; i < 3; ++i) direction[i] = static_cast<float>(ray.direction[i] * inverse_speed);
  }

  float limit(double t) const { return rounded_up(t - t_start); }

 private:
  /// All coordinates are below `size`.
  void prepare_for_boxes(const geometry::PreparedRay& ray, const Vec3& from, double size, bool is_in_range) {
    const double fastest = fastest_inverse * std::fabs(ray.shear_z);
    // A start that was moved is off by the double operations that did it.
    const double least = least_widening * size + (t_start > 0 ? 0x1p-16 * static_cast<double>(error) : 0);
    const hn::CappedTag<float, 4> d;
    unsigned octant = 0;
    const auto prepare = [&](auto at, auto unclamped, std::size_t first) HWY_ATTR {
      const auto most = hn::Set(d, is_in_range ? static_cast<float>(fastest) : 0);
      const auto inverse = hn::Min(hn::Max(unclamped, hn::Neg(most)), most);
      // Off by a rounding each are the origin, its sum with this, and an offset; a product by two if the plane is no
      // further away than twice the origin, and by less than the slack if it is.
      const auto widening = hn::CopySign(
          hn::MulAdd(hn::Abs(at), hn::Set(d, 7 * roundoff), hn::Set(d, static_cast<float>(least))), inverse);
      const auto near = hn::Mul(inverse, hn::Set(d, 1 - slack)), far = hn::Mul(inverse, hn::Set(d, 1 + slack));
      hn::Store(at, d, origin + first);
      hn::Store(near, d, near_inverse + first);
      hn::Store(far, d, far_inverse + first);
      const auto near_at = hn::Add(at, widening), far_at = hn::Sub(at, widening);
      hn::Store(hn::Neg(hn::Mul(near_at, near)), d, near_offset + first);
      hn::Store(hn::Neg(hn::Mul(far_at, far)), d, far_offset + first);
      std::uint8_t is_backwards[8]{};
      hn::StoreMaskBits(d, hn::Lt(inverse, hn::Zero(d)), is_backwards);
      octant |= static_cast<unsigned>(is_backwards[0]) << first & 7u;
    };
    const auto number = [&](double x) HWY_ATTR { return hn::Set(d, static_cast<float>(x)); };
#if HWY_TARGET == HWY_SCALAR
    for (int i = 0; i < 3; ++i) prepare(number(from[i]), number(ray.inverse[i]), static_cast<std::size_t>(i));
#else
    const auto vector = [&](const Vec3& v) HWY_ATTR {
      return hn::ConcatLowerLower(d, hn::InterleaveLower(d, number(v.z), hn::Zero(d)),
                                  hn::InterleaveLower(d, number(v.x), number(v.y)));
    };
    prepare(vector(from), vector(ray.inverse), 0);
#endif
    if (!is_in_range) std::fill_n(far_offset, 3, std::numeric_limits<float>::max());  // meets every box
    near_row = rows_of_octant(octant), far_row = rows_of_octant(~octant);
  }

  void start_near(const WideTree& tree, const geometry::PreparedRay& ray, Vec3& from) {
    const double speed = math::length(ray.direction);
    const double t = (math::length(from) - 4 * tree.reach()) / speed;
    const Vec3 moved = from + ray.direction * t;
    if (!(t > 0) || !math::is_finite(moved)) return;
    t_start = t;
    from = moved;
  }
};

}  // namespace
}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
