// Compiled once per instruction set; the best one the processor has is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/accel/wide_walk.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "engine/accel/shaft.h"
#include "engine/accel/wide_tree.h"
#include "engine/math/error_free.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, WideTree::width>;
using Doubles = hn::CappedTag<double, WideTree::block_width>;

// A tree of depth d pushes at most 7 siblings a level; tree.cpp bounds d by 96 binary levels, a third of that here.
constexpr std::size_t stack_size = 7 * 96 + 8;

template <class D, class Mask>
unsigned bits(D d, Mask mask) {
  std::uint8_t bytes[8]{};
  hn::StoreMaskBits(d, mask, bytes);
  return bytes[0];
}

struct Pending {
  std::uint32_t child;
  float near;
};

/// A ray for boxes in single precision. Each rounding goes the way that makes a box larger.
struct BoxRay {
  // By axis: the planes met first and last, as rows of Node::bounds; the origin and reciprocal to use with each.
  int near_row[3], far_row[3];
  float near_origin[3], far_origin[3], near_inverse[3], far_inverse[3];

  explicit BoxRay(const geometry::PreparedRay& ray) {
    constexpr double slack =
        8 * 0x1p-24;  // of the float operations of the slab test, and 2γ(8) of the shapes' own tests
    for (int axis = 0; axis < 3; ++axis) {
      const bool backwards = std::signbit(ray.inverse[axis]);
      near_row[axis] = backwards ? axis + 3 : axis;
      far_row[axis] = backwards ? axis : axis + 3;
      const auto origin = static_cast<float>(ray.origin[axis]);
      const float rounding = std::fabs(origin) * 0x1p-23F + std::numeric_limits<float>::min();
      const float below = origin - rounding, above = origin + rounding;
      near_origin[axis] = backwards ? below : above;
      far_origin[axis] = backwards ? above : below;
      near_inverse[axis] = static_cast<float>(ray.inverse[axis] * (1 - slack));
      far_inverse[axis] = static_cast<float>(ray.inverse[axis] * (1 + slack));
    }
  }
};

/// Which children the ray enters before `limit`, one bit each, and where.
unsigned enter(const WideTree::Node& node, const BoxRay& ray, float limit, float* near_out) {
  const Floats d;
  unsigned hits = 0;
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    auto near = hn::Zero(d), far = hn::Set(d, limit);
    for (int axis = 0; axis < 3; ++axis) {
      const auto t0 =
          hn::Mul(hn::Sub(hn::Load(d, node.bounds[ray.near_row[axis]] + lane), hn::Set(d, ray.near_origin[axis])),
                  hn::Set(d, ray.near_inverse[axis]));
      const auto t1 =
          hn::Mul(hn::Sub(hn::Load(d, node.bounds[ray.far_row[axis]] + lane), hn::Set(d, ray.far_origin[axis])),
                  hn::Set(d, ray.far_inverse[axis]));
      // Comparisons with NaN (a ray in the plane of a face) are false and keep the running value.
      near = hn::IfThenElse(hn::Gt(t0, near), t0, near);
      far = hn::IfThenElse(hn::Lt(t1, far), t1, far);
    }
    hn::Store(near, d, near_out + lane);
    hits |= bits(d, hn::Le(near, far)) << lane;
  }
  return hits;
}

/// Which of the block's triangles the ray may meet, one bit each: those not surely missed by the signs of the edge
/// functions, computed as in geometry::intersect.
unsigned may_meet(const WideTree::Block& block, const geometry::PreparedRay& ray, double limit) {
  const Doubles d;
  unsigned hits = 0;
  const auto sx = hn::Set(d, ray.shear_x), sy = hn::Set(d, ray.shear_y);
  const auto ox = hn::Set(d, ray.origin[ray.axis_x]), oy = hn::Set(d, ray.origin[ray.axis_y]),
             oz = hn::Set(d, ray.origin[ray.axis_z]);
  const auto tolerance = hn::Set(d, math::gamma(8));
  const auto zero = hn::Zero(d);
  for (std::size_t lane = 0; lane < WideTree::block_width; lane += hn::Lanes(d)) {
    const auto depth = [&](int v) HWY_ATTR { return hn::Sub(hn::Load(d, block.vertex[v][ray.axis_z] + lane), oz); };
    const auto az = depth(0), bz = depth(1), cz = depth(2);
    const auto x = [&](int v, decltype(az) z) HWY_ATTR {
      return hn::Sub(hn::Sub(hn::Load(d, block.vertex[v][ray.axis_x] + lane), ox), hn::Mul(sx, z));
    };
    const auto y = [&](int v, decltype(az) z) HWY_ATTR {
      return hn::Sub(hn::Sub(hn::Load(d, block.vertex[v][ray.axis_y] + lane), oy), hn::Mul(sy, z));
    };
    const auto ax = x(0, az), ay = y(0, az), bx = x(1, bz), by = y(1, bz), cx = x(2, cz), cy = y(2, cz);
    auto some_negative = hn::FirstN(d, 0), some_positive = hn::FirstN(d, 0), some_nonzero = hn::FirstN(d, 0);
    // Bounds of the rounding of the determinant, and of t times the determinant.
    auto sum = zero, scaled = zero, sum_error = zero, scaled_error = zero;
    const auto edge = [&](decltype(ax) p, decltype(ax) q, decltype(ax) r, decltype(ax) s, decltype(ax) z) HWY_ATTR {
      const auto pq = hn::Mul(p, q), rs = hn::Mul(r, s);
      const auto value = hn::Sub(pq, rs);
      const auto error = hn::Mul(tolerance, hn::Add(hn::Abs(pq), hn::Abs(rs)));
      some_positive = hn::Or(some_positive, hn::Gt(value, error));
      some_negative = hn::Or(some_negative, hn::Lt(value, hn::Neg(error)));
      some_nonzero = hn::Or(some_nonzero, hn::Gt(error, zero));
      sum = hn::Add(sum, value), sum_error = hn::Add(sum_error, error);
      scaled = hn::Add(scaled, hn::Mul(value, z)), scaled_error = hn::Add(scaled_error, hn::Mul(error, hn::Abs(z)));
    };
    edge(cx, by, cy, bx, az), edge(ax, cy, ay, cx, bz), edge(bx, ay, by, ax, cz);
    const auto candidates = hn::AndNot(hn::And(some_negative, some_positive), some_nonzero);
    if (hn::AllFalse(d, candidates)) continue;
    const auto sz = hn::Set(d, ray.shear_z), reach = hn::Set(d, std::min(limit, 1e300));
    const auto t = hn::Xor(hn::Mul(sz, scaled), hn::And(hn::SignBit(d), sum));  // times |determinant|
    const auto t_error = hn::Mul(hn::Set(d, 4.0), hn::Mul(hn::Abs(sz), scaled_error));
    const auto is_behind = hn::Lt(t, hn::Neg(t_error));
    const auto is_beyond = hn::Gt(hn::Sub(t, hn::Mul(reach, hn::Abs(sum))),
                                  hn::Add(t_error, hn::Mul(hn::Set(d, 4.0), hn::Mul(reach, sum_error))));
    const auto has_sign = hn::Gt(hn::Abs(sum), hn::Mul(hn::Set(d, 4.0), sum_error));
    const auto met = hn::AndNot(hn::And(has_sign, hn::Or(is_behind, is_beyond)), candidates);
    hits |= bits(d, met) << lane;
  }
  return hits;
}

bool walk_ray(const WideTree& tree, const geometry::PreparedRay& ray, RayVisitor& visitor) {
  const BoxRay box_ray(ray);
  const auto limit_up = [&] { return static_cast<float>(visitor.limit) * (1 + 0x1p-22F); };
  float limit = limit_up();
  Pending stack[stack_size];
  std::size_t count = 0;
  stack[count++] = {0, 0};
  while (count > 0) {
    const Pending top = stack[--count];
    if (top.near > limit) continue;
    if ((top.child & WideTree::leaf_flag) != 0) {
      const WideTree::Leaf& leaf = tree.leaf(top.child);
      for (const WideTree::Block& block : tree.blocks(leaf)) {
        for (unsigned hits = may_meet(block, ray, visitor.limit); hits != 0; hits &= hits - 1) {
          const auto lane = static_cast<std::size_t>(std::countr_zero(hits));
          if (visitor.triangle(block.id[lane], block.triangle(lane))) return true;
        }
      }
      for (const std::uint32_t other : tree.others(leaf)) {
        if (visitor.other(other)) return true;
      }
      limit = limit_up();
      continue;
    }
    const WideTree::Node& node = tree.nodes()[top.child];
    HWY_ALIGN float near[WideTree::width];
    const std::size_t first = count;
    for (unsigned hits = enter(node, box_ray, limit, near); hits != 0; hits &= hits - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(hits));
      std::size_t place = count++;
      for (; place > first && stack[place - 1].near < near[i]; --place) stack[place] = stack[place - 1];
      stack[place] = {node.child[i], near[i]};
    }
  }
  return false;
}

/// Which children's boxes are not wholly outside one of the shaft's planes, one bit each.
unsigned overlap(const WideTree::Node& node, const Shaft::BoxPlanes& planes) {
  const Floats d;
  unsigned hits = 0;
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    auto outside = hn::FirstN(d, 0);
    for (int axis = 0; axis < 3; ++axis) {
      outside = hn::Or(outside, hn::Gt(hn::Load(d, node.bounds[axis] + lane), hn::Set(d, planes.upper[axis])));
      outside = hn::Or(outside, hn::Lt(hn::Load(d, node.bounds[axis + 3] + lane), hn::Set(d, planes.lower[axis])));
    }
    for (int i = 0; i < planes.count; ++i) {
      const Shaft::BoxPlanes::Plane& plane = planes.plane[i];
      auto value = hn::Set(d, -plane.offset), size = hn::Set(d, plane.slack);
      for (int axis = 0; axis < 3; ++axis) {
        const auto term =
            hn::Mul(hn::Set(d, plane.outward[axis]), hn::Load(d, node.bounds[plane.nearest_row[axis]] + lane));
        value = hn::Add(value, term);
        size = hn::Add(size, hn::Mul(hn::Abs(term), hn::Set(d, 8 * 0x1p-24F)));
      }
      outside = hn::Or(outside, hn::Gt(value, size));
    }
    hits |= bits(d, hn::Not(outside)) << lane;
  }
  return hits;
}

bool walk_shaft(const WideTree& tree, const Shaft& shaft, ShaftVisitor& visitor) {
  const Shaft::BoxPlanes planes = shaft.box_planes();
  std::uint32_t stack[stack_size];
  std::size_t count = 0;
  stack[count++] = 0;
  while (count > 0) {
    const std::uint32_t top = stack[--count];
    if ((top & WideTree::leaf_flag) == 0) {
      const WideTree::Node& node = tree.nodes()[top];
      for (unsigned hits = overlap(node, planes); hits != 0; hits &= hits - 1)
        stack[count++] = node.child[std::countr_zero(hits)];
      continue;
    }
    const WideTree::Leaf& leaf = tree.leaf(top);
    for (const WideTree::Block& block : tree.blocks(leaf)) {
      for (std::size_t lane = 0; lane < WideTree::block_width; ++lane) {
        if (lane > 0 && block.id[lane] == block.id[0]) break;
        if (visitor.triangle(block.id[lane], block.triangle(lane))) return true;
      }
    }
    for (const std::uint32_t other : tree.others(leaf)) {
      if (visitor.other(other)) return true;
    }
  }
  return false;
}

}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace penumbra::accel {

HWY_EXPORT(walk_ray);
HWY_EXPORT(walk_shaft);

bool walk(const WideTree& tree, const geometry::PreparedRay& ray, RayVisitor& visitor) {
  return HWY_DYNAMIC_DISPATCH(walk_ray)(tree, ray, visitor);
}

bool walk(const WideTree& tree, const Shaft& shaft, ShaftVisitor& visitor) {
  return HWY_DYNAMIC_DISPATCH(walk_shaft)(tree, shaft, visitor);
}

}  // namespace penumbra::accel
#endif
