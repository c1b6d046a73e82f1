#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/accel/region_walk.cpp"
#include "engine/accel/simd-inl.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/accel/normal_cones.h"
#include "engine/accel/wide_walk.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using simd::HWY_NAMESPACE::bits;

using Floats = hn::CappedTag<float, WideTree::width>;
constexpr float roundoff = 0x1p-24F;
constexpr float underflow = 0x1p-110F;  // products below it are mostly rounding

/// A region in single precision, and the ball to see silhouettes from, both relative to a tree's origin.
struct FloatRegion {
  HalfSpaces::FloatPlanes planes;
  float apex[3], error;  // the middle of the ball; its radius, rounding included
  float rounding;        // of a difference of two vertices

  FloatRegion(const WideTree& tree, const HalfSpaces& region, const Silhouettes* silhouettes)
      : planes(region.in_single_precision(tree.origin())) {
    const Vec3 from = silhouettes == nullptr ? Vec3{} : silhouettes->viewpoint - tree.origin();
    const double radius = silhouettes == nullptr ? 0 : silhouettes->radius;
    for (int axis = 0; axis < 3; ++axis) apex[axis] = static_cast<float>(from[axis]);
    error = static_cast<float>(radius * (1 + 0x1p-20) +
                               32 * 0x1p-24 * (tree.reach() + math::max_component(math::abs(from))));
    rounding = static_cast<float>(4 * 0x1p-24 * tree.reach());
  }
};

template <class V>
struct Vector3 {
  V x, y, z;
};

/// The value of a plane at a point.
template <class V>
HWY_INLINE V value_at(const HalfSpaces::FloatPlanes::Plane& plane, const Vector3<V>& at) {
  const Floats d;
  const auto z = hn::MulSub(hn::Set(d, plane.outward[2]), at.z, hn::Set(d, plane.offset));
  return hn::MulAdd(hn::Set(d, plane.outward[0]), at.x, hn::MulAdd(hn::Set(d, plane.outward[1]), at.y, z));
}

/// What the value of a plane may be off at a point whose coordinates lie within ±`size`.
template <class V>
HWY_INLINE V error_of(const HalfSpaces::FloatPlanes::Plane& plane, V size) {
  const Floats d;
  return hn::MulAdd(size, hn::Set(d, plane.rounding), hn::Set(d, plane.slack));
}

template <class V>
HWY_INLINE V largest(const Vector3<V>& v) {
  return hn::Max(hn::Max(hn::Abs(v.x), hn::Abs(v.y)), hn::Abs(v.z));
}

template <class V>
HWY_INLINE Vector3<V> difference(const Vector3<V>& a, const Vector3<V>& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

template <class V>
HWY_INLINE V dot(const Vector3<V>& a, const Vector3<V>& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

template <class V>
HWY_INLINE Vector3<V> cross(const Vector3<V>& a, const Vector3<V>& b) {
  return {hn::NegMulAdd(a.z, b.y, hn::Mul(a.y, b.z)), hn::NegMulAdd(a.x, b.z, hn::Mul(a.z, b.x)),
          hn::NegMulAdd(a.y, b.x, hn::Mul(a.x, b.y))};
}

HWY_INLINE Vector3<hn::Vec<Floats>> load(const float (&rows)[3][WideTree::width], std::size_t lane) {
  const Floats d;
  return {hn::Load(d, rows[0] + lane), hn::Load(d, rows[1] + lane), hn::Load(d, rows[2] + lane)};
}

/// Which lanes face the region's apex alike: what their cones hold lies within `radius` of `center`.
template <class V>
HWY_INLINE unsigned facing_alike(const NormalCones::Cones& cones, std::size_t lane, const FloatRegion& region,
                                 const Vector3<V>& center, V radius) {
  const Floats d;
  const auto x = hn::Sub(hn::Set(d, region.apex[0]), center.x), y = hn::Sub(hn::Set(d, region.apex[1]), center.y),
             z = hn::Sub(hn::Set(d, region.apex[2]), center.z);
  const auto along =
      hn::MulAdd(x, hn::Load(d, cones.axis[0] + lane),
                 hn::MulAdd(y, hn::Load(d, cones.axis[1] + lane), hn::Mul(z, hn::Load(d, cones.axis[2] + lane))));
  const auto squared = hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
  const auto across = hn::Sqrt(hn::Max(hn::Zero(d), hn::NegMulAdd(along, along, squared)));
  // Of a normal n in the cone, n·(apex − center) lies within along·cosine ± across·sine.
  const auto reach = hn::MulAdd(across, hn::Load(d, cones.sine + lane), hn::Add(radius, hn::Set(d, region.error)));
  return bits(d, hn::Gt(hn::Mul(hn::Abs(along), hn::Load(d, cones.cosine + lane)), reach));
}

/// Lanes that may meet the region; of these, those without a silhouette, which lie within its limits. Of triangles,
/// those that lie there, and by edge the lanes whose edge is no silhouette for certain.
struct RegionLanes {
  unsigned met = 0, without_silhouette = 0, within_limits = 0, plain[3]{};
};

HWY_INLINE RegionLanes overlap(const WideTree::Node& node, const NormalCones::Cones* cones, const FloatRegion& region) {
  const Floats d;
  RegionLanes result;
  const HalfSpaces::FloatPlanes& planes = region.planes;
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    auto outside = hn::FirstN(d, 0);
    for (int axis = 0; axis < 3; ++axis) {
      outside = hn::Or(outside, hn::Gt(hn::Load(d, node.bounds[axis] + lane), hn::Set(d, planes.upper[axis])));
      outside = hn::Or(outside, hn::Lt(hn::Load(d, node.bounds[axis + 3] + lane), hn::Set(d, planes.lower[axis])));
    }
    auto size = hn::Abs(hn::Load(d, node.bounds[0] + lane));
    for (int row = 1; row < 6; ++row) size = hn::Max(size, hn::Abs(hn::Load(d, node.bounds[row] + lane)));
    const auto corner = [&](const int* rows) HWY_ATTR {
      return Vector3<hn::Vec<Floats>>{hn::Load(d, node.bounds[rows[0]] + lane),
                                      hn::Load(d, node.bounds[rows[1]] + lane),
                                      hn::Load(d, node.bounds[rows[2]] + lane)};
    };
    for (int i = 0; i < planes.count; ++i) {
      const HalfSpaces::FloatPlanes::Plane& plane = planes.plane[i];
      outside = hn::Or(outside, hn::Gt(value_at(plane, corner(plane.nearest_row)), error_of(plane, size)));
    }
    const unsigned met = bits(d, hn::Not(outside));
    result.met |= met << lane;
    if (met == 0 || cones == nullptr) continue;
    const int lower_rows[3]{0, 1, 2}, upper_rows[3]{3, 4, 5};
    const auto lower = corner(lower_rows), upper = corner(upper_rows);
    const auto half = hn::Set(d, 0.5F);
    const Vector3<hn::Vec<Floats>> center{hn::Mul(half, hn::Add(lower.x, upper.x)),
                                          hn::Mul(half, hn::Add(lower.y, upper.y)),
                                          hn::Mul(half, hn::Add(lower.z, upper.z))};
    const auto x = hn::Sub(upper.x, center.x), y = hn::Sub(upper.y, center.y), z = hn::Sub(upper.z, center.z);
    const auto radius = hn::Sqrt(hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))));
    unsigned alike = met & facing_alike(*cones, lane, region, center, radius);
    for (int i = 0; i < planes.limit_count && alike != 0; ++i) {
      const HalfSpaces::FloatPlanes::Plane& limit = planes.limit[i];
      const int rows[3]{(limit.nearest_row[0] + 3) % 6, (limit.nearest_row[1] + 3) % 6, (limit.nearest_row[2] + 3) % 6};
      alike &= bits(d, hn::Lt(value_at(limit, corner(rows)), hn::Neg(error_of(limit, size))));
    }
    result.without_silhouette |= alike << lane;
  }
  return result;
}

/// At which edges a lane's triangle and its neighbour turn the same side to the apex for certain.
template <class V>
HWY_INLINE void facing_alike(const Vector3<V> (&vertex)[3], const NormalCones::Flanks& flanks, std::size_t lane,
                             const FloatRegion& region, unsigned (&alike)[3]) {
  const Floats d;
  const Vector3<V> apex{hn::Set(d, region.apex[0]), hn::Set(d, region.apex[1]), hn::Set(d, region.apex[2])};
  Vector3<V> edge[3], from_flank[3], to_apex[3];
  auto length = hn::Zero(d), distance = hn::Zero(d);  // the largest component of an edge, and of a way to the apex
  for (std::size_t e = 0; e < 3; ++e) {
    edge[e] = difference(vertex[(e + 1) % 3], vertex[e]);
    from_flank[e] = difference(vertex[e], load(flanks.vertex[e], lane));
    to_apex[e] = difference(apex, vertex[e]);
    length = hn::Max(length, hn::Max(largest(edge[e]), largest(from_flank[e])));
    distance = hn::Max(distance, largest(to_apex[e]));
  }
  // With differences off by r, components of a normal, of products of up to l², are off by 4 l r + 2 r² and rounding;
  // times the way to the apex, the sum of three is off by no more than this. The way itself is off by `error`.
  const auto r = hn::Set(d, region.rounding), off = hn::Set(d, region.error);
  const auto within_normal =
      hn::MulAdd(hn::Mul(hn::Add(distance, off), r), hn::MulAdd(hn::Set(d, 36), length, hn::Mul(hn::Set(d, 6), r)),
                 hn::Set(d, underflow));
  const auto sides = [&](const Vector3<V>& normal, const Vector3<V>& way) HWY_ATTR {
    const auto value = dot(normal, way), error = hn::MulAdd(hn::Sqrt(dot(normal, normal)), off, within_normal);
    return std::pair(hn::Gt(value, error), hn::Lt(value, hn::Neg(error)));
  };
  const auto [in_front, behind] = sides(cross(edge[0], edge[1]), to_apex[0]);
  for (std::size_t e = 0; e < 3; ++e) {
    const auto [other_in_front, other_behind] = sides(cross(edge[e], from_flank[e]), to_apex[e]);
    alike[e] = bits(d, hn::Or(hn::And(in_front, other_in_front), hn::And(behind, other_behind)));
  }
}

HWY_INLINE RegionLanes overlap(const WideTree::TriangleBlock& block, const NormalCones::Flanks* flanks,
                               const FloatRegion& region) {
  const Floats d;
  RegionLanes result;
  const HalfSpaces::FloatPlanes& planes = region.planes;
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    const Vector3<hn::Vec<Floats>> vertex[3]{load(block.vertex[0], lane), load(block.vertex[1], lane),
                                             load(block.vertex[2], lane)};
    const auto size = hn::Max(largest(vertex[0]), hn::Max(largest(vertex[1]), largest(vertex[2])));
    auto outside = hn::IsNaN(vertex[0].x);
    auto beside_ab = outside, beside_bc = outside, beside_ca = outside;
    for (int i = 0; i < planes.count; ++i) {
      const HalfSpaces::FloatPlanes::Plane& plane = planes.plane[i];
      const auto a = value_at(plane, vertex[0]), b = value_at(plane, vertex[1]), c = value_at(plane, vertex[2]);
      const auto error = error_of(plane, size);
      const auto ab = hn::Gt(hn::Min(a, b), error), bc = hn::Gt(hn::Min(b, c), error),
                 ca = hn::Gt(hn::Min(c, a), error);
      outside = hn::Or(outside, hn::And(ab, bc));
      beside_ab = hn::Or(beside_ab, ab), beside_bc = hn::Or(beside_bc, bc), beside_ca = hn::Or(beside_ca, ca);
    }
    const unsigned met = bits(d, hn::Not(outside));
    result.met |= met << lane;
    if (met == 0 || flanks == nullptr) continue;
    unsigned plain[3];
    facing_alike(vertex, *flanks, lane, region, plain);
    plain[0] |= bits(d, beside_ab), plain[1] |= bits(d, beside_bc), plain[2] |= bits(d, beside_ca);
    for (std::size_t e = 0; e < 3; ++e) result.plain[e] |= plain[e] << lane;
    // Triangles that light goes through have no neighbours.
    const auto is_alone = hn::And(hn::IsNaN(hn::Load(d, flanks->vertex[0][0] + lane)),
                                  hn::And(hn::IsNaN(hn::Load(d, flanks->vertex[1][0] + lane)),
                                          hn::IsNaN(hn::Load(d, flanks->vertex[2][0] + lane))));
    unsigned within = met;
    for (int i = 0; i < planes.limit_count && within != 0; ++i) {
      const HalfSpaces::FloatPlanes::Plane& limit = planes.limit[i];
      const auto most =
          hn::Max(value_at(limit, vertex[0]), hn::Max(value_at(limit, vertex[1]), value_at(limit, vertex[2])));
      within &= bits(d, hn::Lt(most, hn::Neg(error_of(limit, size))));
    }
    result.within_limits |= within << lane;
    result.without_silhouette |= (within & plain[0] & plain[1] & plain[2] & bits(d, hn::Not(is_alone))) << lane;
  }
  return result;
}

/// Which spheres are not wholly outside one of the region's planes, one bit each.
HWY_INLINE unsigned overlap(const WideTree::SphereBlock& block, const FloatRegion& region) {
  const Floats d;
  unsigned hits = 0;
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    const Vector3<hn::Vec<Floats>> center = load(block.center, lane);
    const auto radius = hn::Mul(hn::Load(d, block.radius + lane), hn::Set(d, 1 + 8 * roundoff));
    const auto size = largest(center);
    auto outside = hn::IsNaN(radius);
    for (int i = 0; i < region.planes.count; ++i) {
      const HalfSpaces::FloatPlanes::Plane& plane = region.planes.plane[i];
      const auto margin = hn::MulAdd(radius, hn::Set(d, plane.length), error_of(plane, size));
      outside = hn::Or(outside, hn::Gt(value_at(plane, center), margin));
    }
    hits |= bits(d, hn::Not(outside)) << lane;
  }
  return hits;
}

/// What of a region's leaves a visitor is shown; each is true if it ended the walk.
struct RegionWalk {
  const WideTree& tree;
  const FloatRegion float_region;
  const NormalCones* cones;
  RegionVisitor& visitor;
  bool has_left_out = false;

  HWY_INLINE bool at_triangles(std::uint32_t index) {
    const WideTree::TriangleBlock& block = tree.triangle_blocks()[index];
    const RegionLanes lanes = overlap(block, cones == nullptr ? nullptr : &cones->beside_block(index), float_region);
    has_left_out = has_left_out || lanes.without_silhouette != 0;
    for (unsigned hits = lanes.met & ~lanes.without_silhouette; hits != 0; hits &= hits - 1) {
      const int lane = std::countr_zero(hits);
      RegionVisitor::EdgeFlags edges{{}, (lanes.within_limits >> lane & 1) != 0};
      for (std::size_t e = 0; e < 3; ++e) edges.edge[e] = (lanes.plain[e] >> lane & 1) == 0;
      if (visitor.triangle(block.triangle[lane], edges)) return true;
    }
    return false;
  }
  HWY_INLINE bool at_spheres(const WideTree::SphereBlock& block) {
    for (unsigned hits = overlap(block, float_region); hits != 0; hits &= hits - 1) {
      if (visitor.other(block.item[std::countr_zero(hits)])) return true;
    }
    return false;
  }
  HWY_INLINE bool at_leaf(const WideTree::Leaf& leaf) {
    for (auto i = leaf.triangle_begin; i < leaf.triangle_end; ++i) {
      if (at_triangles(i)) return true;
    }
    for (auto i = leaf.sphere_begin; i < leaf.sphere_end; ++i) {
      if (at_spheres(tree.sphere_blocks()[i])) return true;
    }
    for (auto i = leaf.other_begin; i < leaf.other_end; ++i) {
      if (visitor.other(tree.others()[i])) return true;
    }
    return false;
  }
};

bool walk_region(const WideTree& tree, const HalfSpaces& region, const Silhouettes* silhouettes,
                 RegionVisitor& visitor) {
  RegionWalk walk{tree, FloatRegion(tree, region, silhouettes), silhouettes == nullptr ? nullptr : &silhouettes->cones,
                  visitor};
  std::uint32_t stack[WideTree::stack_size];
  std::size_t count = 0;
  stack[count++] = tree.root();
  while (count > 0) {
    const std::uint32_t top = stack[--count], index = WideTree::index_of(top);
    switch (WideTree::sort_of(top)) {
      case WideTree::Sort::node: {
        const WideTree::Node& node = tree.nodes()[index];
        const RegionLanes lanes =
            overlap(node, walk.cones == nullptr ? nullptr : &walk.cones->of_node(index), walk.float_region);
        walk.has_left_out = walk.has_left_out || lanes.without_silhouette != 0;
        for (unsigned hits = lanes.met & ~lanes.without_silhouette; hits != 0; hits &= hits - 1)
          stack[count++] = node.child[std::countr_zero(hits)];
        break;
      }
      case WideTree::Sort::triangle_block:
        if (walk.at_triangles(index)) return true;
        break;
      case WideTree::Sort::sphere_block:
        if (walk.at_spheres(tree.sphere_blocks()[index])) return true;
        break;
      case WideTree::Sort::leaf:
        if (walk.at_leaf(tree.leaves()[index])) return true;
        break;
    }
  }
  if (walk.has_left_out) visitor.without_silhouette();
  return false;
}

}  // namespace
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
