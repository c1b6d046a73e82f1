// Compiled once per instruction set, with the file that includes it.
#if defined(PENUMBRA_ACCEL_RAY_TESTS) == defined(HWY_TARGET_TOGGLE)
#ifdef PENUMBRA_ACCEL_RAY_TESTS
#undef PENUMBRA_ACCEL_RAY_TESTS
#else
#define PENUMBRA_ACCEL_RAY_TESTS
#endif

#include <optional>

#include "engine/accel/bundle.h"
#include "engine/accel/float_ray-inl.h"
#include "engine/accel/wide_walk.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using simd::HWY_NAMESPACE::bits;

using Floats = hn::CappedTag<float, WideTree::width>;

/// Which children the ray enters before `limit`, one bit each; and where, if it is asked for.
template <bool tells_where>
HWY_INLINE unsigned enter(const WideTree::Node& node, const FloatRay& ray, float limit, float* near_out) {
  const Floats d;
  unsigned hits = 0;
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    const float* planes = &node.bounds[0][0] + lane;
    const auto near_at = [&](int axis) HWY_ATTR {
      return hn::MulAdd(hn::Load(d, planes + ray.near_row[axis]), hn::Set(d, ray.near_inverse[axis]),
                        hn::Set(d, ray.near_offset[axis]));
    };
    const auto far_at = [&](int axis) HWY_ATTR {
      return hn::MulAdd(hn::Load(d, planes + ray.far_row[axis]), hn::Set(d, ray.far_inverse[axis]),
                        hn::Set(d, ray.far_offset[axis]));
    };
    const auto near = hn::Max(hn::Max(near_at(0), near_at(1)), hn::Max(near_at(2), hn::Zero(d)));
    const auto far = hn::Min(hn::Min(far_at(0), far_at(1)), hn::Min(far_at(2), hn::Set(d, limit)));
    if constexpr (tells_where) hn::Store(near, d, near_out + lane);
    hits |= bits(d, hn::Le(near, far)) << lane;
  }
  return hits;
}

/// Of a block's lanes: which the ray may meet, which it meets for certain, and between which t.
struct Meetings {
  unsigned possible = 0, certain = 0;
  HWY_ALIGN float t_low[WideTree::width], t_high[WideTree::width];
};

/// The signs of the edge functions of geometry::intersect and the range of t, with bounds of their rounding; a range of
/// the vertices' t, or with `narrows` of what they weigh inside.
template <bool narrows>
HWY_INLINE void meet(const WideTree::TriangleBlock& block, const FloatRay& ray, float limit, Meetings& result) {
  const Floats d;
  const auto sx = hn::Set(d, ray.shear_x), sy = hn::Set(d, ray.shear_y), sz = hn::Set(d, ray.shear_z);
  const auto ox = hn::Set(d, ray.origin[ray.axis[0]]), oy = hn::Set(d, ray.origin[ray.axis[1]]),
             oz = hn::Set(d, ray.origin[ray.axis[2]]);
  const auto coordinate_error = hn::Set(d, ray.error), t_error = hn::Set(d, ray.t_error);
  result.possible = result.certain = 0;
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    const auto az = hn::Sub(hn::Load(d, block.vertex[0][ray.axis[2]] + lane), oz);
    const auto bz = hn::Sub(hn::Load(d, block.vertex[1][ray.axis[2]] + lane), oz);
    const auto cz = hn::Sub(hn::Load(d, block.vertex[2][ray.axis[2]] + lane), oz);
    const auto ax = hn::NegMulAdd(sx, az, hn::Sub(hn::Load(d, block.vertex[0][ray.axis[0]] + lane), ox));
    const auto ay = hn::NegMulAdd(sy, az, hn::Sub(hn::Load(d, block.vertex[0][ray.axis[1]] + lane), oy));
    const auto bx = hn::NegMulAdd(sx, bz, hn::Sub(hn::Load(d, block.vertex[1][ray.axis[0]] + lane), ox));
    const auto by = hn::NegMulAdd(sy, bz, hn::Sub(hn::Load(d, block.vertex[1][ray.axis[1]] + lane), oy));
    const auto cx = hn::NegMulAdd(sx, cz, hn::Sub(hn::Load(d, block.vertex[2][ray.axis[0]] + lane), ox));
    const auto cy = hn::NegMulAdd(sy, cz, hn::Sub(hn::Load(d, block.vertex[2][ray.axis[1]] + lane), oy));
    const auto u = hn::Sub(hn::Mul(cx, by), hn::Mul(cy, bx));
    const auto v = hn::Sub(hn::Mul(ax, cy), hn::Mul(ay, cx));
    const auto w = hn::Sub(hn::Mul(bx, ay), hn::Mul(by, ax));
    // With every coordinate below m and off by e, a difference of products is off by 4em + 2e² and three roundings of
    // m²; a rounding of m is below e/8.
    const auto m = hn::Max(hn::Max(hn::Max(hn::Abs(ax), hn::Abs(ay)), hn::Max(hn::Abs(bx), hn::Abs(by))),
                           hn::Max(hn::Abs(cx), hn::Abs(cy)));
    const auto error =
        hn::Mul(coordinate_error, hn::Add(hn::Mul(hn::Set(d, 5.0F), m), hn::Add(coordinate_error, coordinate_error)));
    const auto least = hn::Min(hn::Min(u, v), w), most = hn::Max(hn::Max(u, v), w);
    // NaN in unused lanes: every comparison below is false, so they are neither possible nor certain. A NaN of t alone
    // keeps the lane possible.
    const auto is_near = hn::Or(hn::Ge(least, hn::Neg(error)), hn::Le(most, error));
    if (hn::AllFalse(d, is_near)) continue;
    const auto t0 = hn::Mul(az, sz), t1 = hn::Mul(bz, sz), t2 = hn::Mul(cz, sz);
    auto t_low = hn::Sub(hn::Min(hn::Min(t0, t1), t2), t_error);
    auto t_high = hn::Add(hn::Max(hn::Max(t0, t1), t2), t_error);
    const auto is_out = hn::Or(hn::Lt(t_high, hn::Zero(d)), hn::Gt(t_low, hn::Set(d, limit)));
    const auto possible = hn::AndNot(is_out, is_near);
    const unsigned possible_bits = bits(d, possible);
    if (possible_bits == 0) continue;
    const auto is_inside = hn::Or(hn::Gt(least, error), hn::Lt(most, hn::Neg(error)));
    if constexpr (narrows) {
      // The mean of the three is off by up to six times what an edge function may be off, over the sum. Weights first:
      // a product of three lengths may leave the range of single precision.
      const auto sum = hn::Add(hn::Add(u, v), w);
      const auto inverse = hn::Div(hn::Set(d, 1.0F), sum);
      const auto t =
          hn::MulAdd(hn::Mul(u, inverse), t0, hn::MulAdd(hn::Mul(v, inverse), t1, hn::Mul(hn::Mul(w, inverse), t2)));
      const auto size = hn::Max(hn::Max(hn::Abs(t0), hn::Abs(t1)), hn::Abs(t2));
      const auto within = hn::MulAdd(
          size, hn::MulAdd(hn::Set(d, 7.0F), hn::Div(error, hn::Abs(sum)), hn::Set(d, 8 * roundoff)), t_error);
      t_low = hn::IfThenElse(is_inside, hn::Max(hn::Sub(t, within), t_low), t_low);
      t_high = hn::IfThenElse(is_inside, hn::Min(hn::Add(t, within), t_high), t_high);
    }
    const auto is_between = hn::And(hn::Gt(t_low, t_error), hn::Lt(t_high, hn::Set(d, limit)));
    result.possible |= possible_bits << lane;
    result.certain |= bits(d, hn::And(possible, hn::And(is_inside, is_between))) << lane;
    hn::Store(t_low, d, result.t_low + lane);
    hn::Store(t_high, d, result.t_high + lane);
  }
}

/// Which spheres the ray may meet before `limit`, one bit each.
HWY_INLINE unsigned meet(const WideTree::SphereBlock& block, const FloatRay& ray, float limit) {
  const Floats d;
  unsigned hits = 0;
  const auto error = hn::Set(d, ray.error), dx = hn::Set(d, ray.direction[0]), dy = hn::Set(d, ray.direction[1]),
             dz = hn::Set(d, ray.direction[2]);
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    const auto lx = hn::Sub(hn::Load(d, block.center[0] + lane), hn::Set(d, ray.origin[0]));
    const auto ly = hn::Sub(hn::Load(d, block.center[1] + lane), hn::Set(d, ray.origin[1]));
    const auto lz = hn::Sub(hn::Load(d, block.center[2] + lane), hn::Set(d, ray.origin[2]));
    const auto along = hn::MulAdd(lx, dx, hn::MulAdd(ly, dy, hn::Mul(lz, dz)));
    const auto px = hn::NegMulAdd(along, dx, lx), py = hn::NegMulAdd(along, dy, ly), pz = hn::NegMulAdd(along, dz, lz);
    const auto squared = hn::MulAdd(px, px, hn::MulAdd(py, py, hn::Mul(pz, pz)));
    // Every length here is off by at most 19 roundings of the coordinates, 8.5 of which `error` is, and its square by a
    // few roundings of its own in addition.
    const auto radius =
        hn::MulAdd(hn::Load(d, block.radius + lane), hn::Set(d, 1 + 8 * roundoff), hn::Mul(hn::Set(d, 3.0F), error));
    const auto is_near = hn::Le(squared, hn::Mul(radius, radius));
    const auto is_out = hn::Or(
        hn::Lt(hn::Add(along, radius), hn::Zero(d)),
        hn::Gt(hn::Mul(hn::Sub(along, radius), hn::Set(d, ray.t_of_length * (1 - 4 * roundoff))), hn::Set(d, limit)));
    hits |= bits(d, hn::AndNot(is_out, is_near)) << lane;
  }
  return hits;
}

/// Visits a leaf; true if the visitor ended the walk.
template <class Visitor>
HWY_INLINE bool visit_leaf(const WideTree& tree, std::uint32_t reference, Visitor& visitor) {
  switch (WideTree::sort_of(reference)) {
    case WideTree::Sort::triangle_block:
      return visitor.triangles(tree.triangle_blocks()[WideTree::index_of(reference)]);
    case WideTree::Sort::sphere_block:
      return visitor.spheres(tree.sphere_blocks()[WideTree::index_of(reference)]);
    default:
      break;
  }
  const WideTree::Leaf& leaf = tree.leaves()[WideTree::index_of(reference)];
  for (auto i = leaf.triangle_begin; i < leaf.triangle_end; ++i) {
    if (visitor.triangles(tree.triangle_blocks()[i])) return true;
  }
  for (auto i = leaf.sphere_begin; i < leaf.sphere_end; ++i) {
    if (visitor.spheres(tree.sphere_blocks()[i])) return true;
  }
  for (auto i = leaf.other_begin; i < leaf.other_end; ++i) {
    if (visitor.other(tree.others()[i])) return true;
  }
  return false;
}

/// A ray as the tests in double precision need it, made when one of them is.
class ExactRay {
 public:
  explicit ExactRay(const geometry::PreparedRay& ray) : given_(&ray) {}
  ExactRay(const Bundle& bundle, std::size_t index) : bundle_(&bundle), index_(index) {}
  const geometry::PreparedRay& operator()() const {
    if (given_ == nullptr) given_ = &made_.emplace(bundle_->prepared(index_));
    return *given_;
  }

 private:
  mutable const geometry::PreparedRay* given_ = nullptr;
  const Bundle* bundle_ = nullptr;
  std::size_t index_ = 0;
  mutable std::optional<geometry::PreparedRay> made_;
};

/// What a walk needs to know.
struct Walk {
  const OwnedTriangles& triangles;
  const World& world;
  ExactRay ray;
  const FloatRay& float_ray;
  const SurfaceId& self;
};

}  // namespace
}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
