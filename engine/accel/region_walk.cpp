// Compiled once per instruction set; the best one the processor has is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/accel/region_walk.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/accel/normal_cones.h"
#include "engine/accel/wide_walk.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, WideTree::width>;
constexpr float roundoff = 0x1p-24F;

template <class D, class Mask>
unsigned bits(D d, Mask mask) {
  std::uint8_t bytes[8]{};
  hn::StoreMaskBits(d, mask, bytes);
  return bytes[0];
}

/// A region in single precision, and the point to see silhouettes from, both relative to a tree's origin.
struct FloatShaft {
  HalfSpaces::FloatPlanes planes;
  float apex[3], error;

  FloatShaft(const WideTree& tree, const HalfSpaces& region, const Vec3& viewpoint)
      : planes(region.in_single_precision(tree.origin())) {
    const Vec3 from = viewpoint - tree.origin();
    for (int axis = 0; axis < 3; ++axis) apex[axis] = static_cast<float>(from[axis]);
    error = static_cast<float>(32 * 0x1p-24 * (tree.reach() + math::max_component(math::abs(from))));
  }
};

template <class V>
struct Vector3 {
  V x, y, z;
};

/// The value of a plane at a point, and what it may be off.
template <class V>
HWY_INLINE std::pair<V, V> value_at(const HalfSpaces::FloatPlanes::Plane& plane, const Vector3<V>& at) {
  const Floats d;
  const auto x = hn::Mul(hn::Set(d, plane.outward[0]), at.x), y = hn::Mul(hn::Set(d, plane.outward[1]), at.y),
             z = hn::Mul(hn::Set(d, plane.outward[2]), at.z);
  const auto value = hn::Add(hn::Add(x, y), hn::Sub(z, hn::Set(d, plane.offset)));
  const auto size = hn::Add(hn::Add(hn::Abs(x), hn::Abs(y)), hn::Abs(z));
  return {value, hn::MulAdd(size, hn::Set(d, 8 * roundoff), hn::Set(d, plane.slack))};
}

/// Which lanes face the shaft's apex alike: what their cones hold lies within `radius` of `centre`.
template <class V>
HWY_INLINE unsigned facing_alike(const NormalCones::Cones& cones, std::size_t lane, const FloatShaft& shaft,
                                 const Vector3<V>& centre, V radius) {
  const Floats d;
  const auto x = hn::Sub(hn::Set(d, shaft.apex[0]), centre.x), y = hn::Sub(hn::Set(d, shaft.apex[1]), centre.y),
             z = hn::Sub(hn::Set(d, shaft.apex[2]), centre.z);
  const auto along =
      hn::MulAdd(x, hn::Load(d, cones.axis[0] + lane),
                 hn::MulAdd(y, hn::Load(d, cones.axis[1] + lane), hn::Mul(z, hn::Load(d, cones.axis[2] + lane))));
  const auto squared = hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
  const auto across = hn::Sqrt(hn::Max(hn::Zero(d), hn::NegMulAdd(along, along, squared)));
  // Of a normal n in the cone, n·(apex − centre) lies within along·cosine ± across·sine.
  const auto reach = hn::MulAdd(across, hn::Load(d, cones.sine + lane), hn::Add(radius, hn::Set(d, shaft.error)));
  return bits(d, hn::Gt(hn::Mul(hn::Abs(along), hn::Load(d, cones.cosine + lane)), reach));
}

/// Lanes that may meet the shaft; of these, those without a silhouette.
struct ShaftLanes {
  unsigned met = 0, without_silhouette = 0;
};

HWY_INLINE ShaftLanes overlap(const WideTree::Node& node, const NormalCones::Cones* cones, const FloatShaft& shaft) {
  const Floats d;
  ShaftLanes result;
  const HalfSpaces::FloatPlanes& planes = shaft.planes;
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    auto outside = hn::FirstN(d, 0);
    for (int axis = 0; axis < 3; ++axis) {
      outside = hn::Or(outside, hn::Gt(hn::Load(d, node.bounds[axis] + lane), hn::Set(d, planes.upper[axis])));
      outside = hn::Or(outside, hn::Lt(hn::Load(d, node.bounds[axis + 3] + lane), hn::Set(d, planes.lower[axis])));
    }
    const auto corner = [&](const int* rows) HWY_ATTR {
      return Vector3<decltype(hn::Zero(d))>{hn::Load(d, node.bounds[rows[0]] + lane),
                                            hn::Load(d, node.bounds[rows[1]] + lane),
                                            hn::Load(d, node.bounds[rows[2]] + lane)};
    };
    for (int i = 0; i < planes.count; ++i) {
      const auto [value, error] = value_at(planes.plane[i], corner(planes.plane[i].nearest_row));
      outside = hn::Or(outside, hn::Gt(value, error));
    }
    const unsigned met = bits(d, hn::Not(outside));
    result.met |= met << lane;
    if (met == 0 || cones == nullptr) continue;
    const int lower_rows[3]{0, 1, 2}, upper_rows[3]{3, 4, 5};
    const auto lower = corner(lower_rows), upper = corner(upper_rows);
    const auto half = hn::Set(d, 0.5F);
    const Vector3<decltype(hn::Zero(d))> centre{hn::Mul(half, hn::Add(lower.x, upper.x)),
                                                hn::Mul(half, hn::Add(lower.y, upper.y)),
                                                hn::Mul(half, hn::Add(lower.z, upper.z))};
    const auto x = hn::Sub(upper.x, centre.x), y = hn::Sub(upper.y, centre.y), z = hn::Sub(upper.z, centre.z);
    const auto radius = hn::Sqrt(hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))));
    unsigned alike = met & facing_alike(*cones, lane, shaft, centre, radius);
    if (alike != 0 && planes.far >= 0) {
      const HalfSpaces::FloatPlanes::Plane& far = planes.plane[planes.far];
      const int rows[3]{(far.nearest_row[0] + 3) % 6, (far.nearest_row[1] + 3) % 6, (far.nearest_row[2] + 3) % 6};
      const auto [value, error] = value_at(far, corner(rows));
      alike &= bits(d, hn::Lt(value, hn::Neg(error)));
    }
    result.without_silhouette |= alike << lane;
  }
  return result;
}

HWY_INLINE ShaftLanes overlap(const WideTree::TriangleBlock& block, const NormalCones::Cones* cones,
                              const FloatShaft& shaft) {
  const Floats d;
  ShaftLanes result;
  const HalfSpaces::FloatPlanes& planes = shaft.planes;
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    const auto vertex = [&](std::size_t v) HWY_ATTR {
      return Vector3<decltype(hn::Zero(d))>{hn::Load(d, block.vertex[v][0] + lane),
                                            hn::Load(d, block.vertex[v][1] + lane),
                                            hn::Load(d, block.vertex[v][2] + lane)};
    };
    const auto a = vertex(0), b = vertex(1), c = vertex(2);
    auto outside = hn::IsNaN(a.x);
    auto is_before_far = hn::FirstN(d, WideTree::width);
    for (int i = 0; i < planes.count; ++i) {
      const auto [value_a, error_a] = value_at(planes.plane[i], a);
      const auto [value_b, error_b] = value_at(planes.plane[i], b);
      const auto [value_c, error_c] = value_at(planes.plane[i], c);
      outside = hn::Or(outside,
                       hn::And(hn::Gt(value_a, error_a), hn::And(hn::Gt(value_b, error_b), hn::Gt(value_c, error_c))));
      if (i == planes.far) {
        is_before_far = hn::And(hn::Lt(value_a, hn::Neg(error_a)),
                                hn::And(hn::Lt(value_b, hn::Neg(error_b)), hn::Lt(value_c, hn::Neg(error_c))));
      }
    }
    const unsigned met = bits(d, hn::Not(outside));
    result.met |= met << lane;
    if (met == 0 || cones == nullptr) continue;
    const auto x = hn::Max(hn::Abs(hn::Sub(b.x, a.x)), hn::Abs(hn::Sub(c.x, a.x)));
    const auto y = hn::Max(hn::Abs(hn::Sub(b.y, a.y)), hn::Abs(hn::Sub(c.y, a.y)));
    const auto z = hn::Max(hn::Abs(hn::Sub(b.z, a.z)), hn::Abs(hn::Sub(c.z, a.z)));
    const auto radius = hn::Sqrt(hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))));
    result.without_silhouette |= (met & facing_alike(*cones, lane, shaft, a, radius) & bits(d, is_before_far)) << lane;
  }
  return result;
}

/// Which spheres are not wholly outside one of the shaft's planes, one bit each.
HWY_INLINE unsigned overlap(const WideTree::SphereBlock& block, const FloatShaft& shaft) {
  const Floats d;
  unsigned hits = 0;
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    const Vector3<decltype(hn::Zero(d))> centre{
        hn::Load(d, block.center[0] + lane), hn::Load(d, block.center[1] + lane), hn::Load(d, block.center[2] + lane)};
    const auto radius = hn::Mul(hn::Load(d, block.radius + lane), hn::Set(d, 1 + 8 * roundoff));
    auto outside = hn::IsNaN(radius);
    for (int i = 0; i < shaft.planes.count; ++i) {
      const HalfSpaces::FloatPlanes::Plane& plane = shaft.planes.plane[i];
      const auto [value, error] = value_at(plane, centre);
      outside = hn::Or(outside, hn::Gt(value, hn::MulAdd(radius, hn::Set(d, plane.length), error)));
    }
    hits |= bits(d, hn::Not(outside)) << lane;
  }
  return hits;
}

bool walk_region(const WideTree& tree, const HalfSpaces& region, const Silhouettes* silhouettes,
                 RegionVisitor& visitor) {
  const FloatShaft float_shaft(tree, region, silhouettes == nullptr ? tree.origin() : silhouettes->viewpoint);
  const NormalCones* cones = silhouettes == nullptr ? nullptr : &silhouettes->cones;
  std::uint32_t stack[WideTree::stack_size];
  std::size_t count = 0;
  stack[count++] = tree.root();
  bool has_left_out = false;
  const auto at_triangles = [&](std::uint32_t index) {
    const WideTree::TriangleBlock& block = tree.triangle_blocks()[index];
    const ShaftLanes lanes = overlap(block, cones == nullptr ? nullptr : &cones->of_triangle_block(index), float_shaft);
    has_left_out = has_left_out || lanes.without_silhouette != 0;
    for (unsigned hits = lanes.met & ~lanes.without_silhouette; hits != 0; hits &= hits - 1) {
      if (visitor.triangle(block.triangle[std::countr_zero(hits)])) return true;
    }
    return false;
  };
  const auto at_spheres = [&](const WideTree::SphereBlock& block) {
    for (unsigned hits = overlap(block, float_shaft); hits != 0; hits &= hits - 1) {
      if (visitor.other(block.item[std::countr_zero(hits)])) return true;
    }
    return false;
  };
  while (count > 0) {
    const std::uint32_t top = stack[--count], index = WideTree::index_of(top);
    switch (WideTree::sort_of(top)) {
      case WideTree::Sort::node: {
        const WideTree::Node& node = tree.nodes()[index];
        const ShaftLanes lanes = overlap(node, cones == nullptr ? nullptr : &cones->of_node(index), float_shaft);
        has_left_out = has_left_out || lanes.without_silhouette != 0;
        for (unsigned hits = lanes.met & ~lanes.without_silhouette; hits != 0; hits &= hits - 1)
          stack[count++] = node.child[std::countr_zero(hits)];
        break;
      }
      case WideTree::Sort::triangle_block:
        if (at_triangles(index)) return true;
        break;
      case WideTree::Sort::sphere_block:
        if (at_spheres(tree.sphere_blocks()[index])) return true;
        break;
      case WideTree::Sort::leaf: {
        const WideTree::Leaf& leaf = tree.leaves()[index];
        for (auto i = leaf.triangle_begin; i < leaf.triangle_end; ++i) {
          if (at_triangles(i)) return true;
        }
        for (auto i = leaf.sphere_begin; i < leaf.sphere_end; ++i) {
          if (at_spheres(tree.sphere_blocks()[i])) return true;
        }
        for (auto i = leaf.other_begin; i < leaf.other_end; ++i) {
          if (visitor.other(tree.others()[i])) return true;
        }
        break;
      }
    }
  }
  if (has_left_out) visitor.without_silhouette();
  return false;
}

}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace penumbra::accel {

HWY_EXPORT(walk_region);

bool walk(const WideTree& tree, const HalfSpaces& region, const Silhouettes* silhouettes, RegionVisitor& visitor) {
  return HWY_DYNAMIC_DISPATCH(walk_region)(tree, region, silhouettes, visitor);
}

}  // namespace penumbra::accel
#endif
