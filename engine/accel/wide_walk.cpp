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
#include <utility>

#include "engine/accel/normal_cones.h"
#include "engine/accel/shaft.h"
#include "engine/accel/wide_walk.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, WideTree::width>;
constexpr float roundoff = 0x1p-24F;

// wide_build.cpp bounds the depth by 48 levels of any split and 32 that halve the entries; a level leaves at most 7
// siblings behind.
constexpr std::size_t stack_size = 7 * (48 + 32) + 8;

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
      const auto rounding = hn::MulAdd(hn::Abs(o), hn::Set(d, 2.5F * roundoff),
                                       hn::Set(d, std::numeric_limits<float>::min() + moved));
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

/// Which children the ray enters before `limit`, one bit each, and where.
HWY_INLINE unsigned enter(const WideTree::Node& node, const FloatRay& ray, float limit, float* near_out) {
  const Floats d;
  unsigned hits = 0;
  for (std::size_t lane = 0; lane < WideTree::width; lane += hn::Lanes(d)) {
    const float* planes = &node.bounds[0][0] + lane;
    const auto at = [&](std::size_t row, float origin, float inverse) HWY_ATTR {
      return hn::Mul(hn::Sub(hn::Load(d, planes + row), hn::Set(d, origin)), hn::Set(d, inverse));
    };
    const auto near_at = [&](int axis) HWY_ATTR {
      return at(ray.near_row[axis], ray.near_origin[axis], ray.near_inverse[axis]);
    };
    const auto far_at = [&](int axis) HWY_ATTR {
      return at(ray.far_row[axis], ray.far_origin[axis], ray.far_inverse[axis]);
    };
    // No plane contains the origin as rounded, so there is no 0·∞.
    const auto near = hn::Max(hn::Max(near_at(0), near_at(1)), hn::Max(near_at(2), hn::Zero(d)));
    const auto far = hn::Min(hn::Min(far_at(0), far_at(1)), hn::Min(far_at(2), hn::Set(d, limit)));
    hn::Store(near, d, near_out + lane);
    hits |= bits(d, hn::Le(near, far)) << lane;
  }
  return hits;
}

/// Of a block's lanes: which the ray may meet, which it meets for certain, and between which t.
struct Meetings {
  unsigned possible = 0, certain = 0;
  HWY_ALIGN float t_low[WideTree::width], t_high[WideTree::width];
};

/// The signs of the edge functions of geometry::intersect and the range of t, with bounds of their rounding.
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
    const auto t0 = hn::Mul(az, sz), t1 = hn::Mul(bz, sz), t2 = hn::Mul(cz, sz);
    const auto t_low = hn::Sub(hn::Min(hn::Min(t0, t1), t2), t_error);
    const auto t_high = hn::Add(hn::Max(hn::Max(t0, t1), t2), t_error);
    // NaN in unused lanes: every comparison below is false, so they are neither possible nor certain. A NaN of t alone
    // keeps the lane possible.
    const auto is_near = hn::Or(hn::Ge(least, hn::Neg(error)), hn::Le(most, error));
    const auto is_out = hn::Or(hn::Lt(t_high, hn::Zero(d)), hn::Gt(t_low, hn::Set(d, limit)));
    const auto possible = hn::AndNot(is_out, is_near);
    const unsigned possible_bits = bits(d, possible);
    if (possible_bits == 0) continue;
    const auto is_inside = hn::Or(hn::Gt(least, error), hn::Lt(most, hn::Neg(error)));
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

/// Visits what the ray may meet before `visitor.limit()`, roughly nearest first; true if the visitor ended it.
template <class Visitor>
HWY_INLINE bool walk_ray(const WideTree& tree, const FloatRay& ray, Visitor& visitor) {
  Pending stack[stack_size];
  std::size_t count = 0;
  std::uint32_t current = tree.root();
  while (true) {
    if (WideTree::sort_of(current) == WideTree::Sort::node) {
      const WideTree::Node& node = tree.nodes()[current];
      HWY_ALIGN float near[WideTree::width];
      unsigned hits = enter(node, ray, visitor.limit(), near);
      if (hits != 0) {
        const auto first_lane = static_cast<std::size_t>(std::countr_zero(hits));
        hits &= hits - 1;
        if (hits == 0) {
          current = node.child[first_lane];
          continue;
        }
        const std::size_t first = count;
        stack[count++] = {node.child[first_lane], near[first_lane]};
        for (; hits != 0; hits &= hits - 1) {
          const auto i = static_cast<std::size_t>(std::countr_zero(hits));
          std::size_t place = count++;
          for (; place > first && stack[place - 1].near < near[i]; --place) stack[place] = stack[place - 1];
          stack[place] = {node.child[i], near[i]};
        }
        current = stack[--count].child;
        continue;
      }
    } else if (WideTree::sort_of(current) == WideTree::Sort::triangle_block) {
      if (visitor.triangles(tree.triangle_blocks()[WideTree::index_of(current)])) return true;
    } else if (WideTree::sort_of(current) == WideTree::Sort::sphere_block) {
      if (visitor.spheres(tree.sphere_blocks()[WideTree::index_of(current)])) return true;
    } else {
      const WideTree::Leaf& leaf = tree.leaves()[WideTree::index_of(current)];
      for (auto i = leaf.triangle_begin; i < leaf.triangle_end; ++i) {
        if (visitor.triangles(tree.triangle_blocks()[i])) return true;
      }
      for (auto i = leaf.sphere_begin; i < leaf.sphere_end; ++i) {
        if (visitor.spheres(tree.sphere_blocks()[i])) return true;
      }
      for (auto i = leaf.other_begin; i < leaf.other_end; ++i) {
        if (visitor.other(tree.others()[i])) return true;
      }
    }
    do {
      if (count == 0) return false;
      --count;
    } while (stack[count].near > visitor.limit());
    current = stack[count].child;
  }
}

/// Keeps triangles that may be nearest until the walk is over: then few are left to test in double precision.
class ToNearest {
 public:
  ToNearest(const OwnedTriangles& triangles, const World& world, const geometry::PreparedRay& ray,
            const FloatRay& float_ray, const SurfaceId& self, Nearest& nearest)
      : triangles_(triangles),
        world_(world),
        ray_(ray),
        float_ray_(float_ray),
        self_(self),
        self_triangle_(triangles.index(self)),
        nearest_(nearest),
        limit_(float_ray.limit(nearest.limit)) {}

  float limit() const { return limit_; }

  bool triangles(const WideTree::TriangleBlock& block) {
    Meetings met;
    meet(block, float_ray_, limit_, met);
    for (unsigned hits = met.possible; hits != 0; hits &= hits - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(hits));
      if (block.triangle[lane] == self_triangle_) continue;
      if (count_ == capacity) decide();
      const bool is_certain = (met.certain >> lane & 1u) != 0;
      waiting_[count_++] = {block.triangle[lane], met.t_low[lane], is_certain};
      if (is_certain) limit_ = std::min(limit_, met.t_high[lane]);
    }
    return false;
  }
  bool spheres(const WideTree::SphereBlock& block) {
    for (unsigned hits = meet(block, float_ray_, limit_); hits != 0; hits &= hits - 1) {
      other(block.item[std::countr_zero(hits)]);
    }
    return false;
  }
  bool other(std::uint32_t item) {
    find_in_item(world_, item, ray_, self_, nearest_);
    limit_ = std::min(limit_, float_ray_.limit(nearest_.limit));
    return false;
  }

  /// Tests what is waiting.
  void decide() {
    for (std::size_t i = 0; i < count_; ++i) {
      if (waiting_[i].t_low > limit_) continue;
      const std::uint32_t triangle = waiting_[i].triangle;
      const std::optional<geometry::TriangleHit> hit =
          waiting_[i].is_certain ? intersect_certainly(triangles_[triangle], ray_)
                                 : intersect(triangles_[triangle], ray_, nearest_.limit);
      if (!hit || !(hit->t < nearest_.limit)) continue;
      nearest_.offer(hit->t, triangles_.surface(triangle), hit->b1, hit->b2);
      limit_ = std::min(limit_, float_ray_.limit(nearest_.limit));
    }
    count_ = 0;
  }

 private:
  static constexpr std::size_t capacity = 32;
  struct Waiting {
    std::uint32_t triangle;
    float t_low;
    bool is_certain;
  };
  const OwnedTriangles& triangles_;
  const World& world_;
  const geometry::PreparedRay& ray_;
  const FloatRay& float_ray_;
  const SurfaceId& self_;
  std::uint32_t self_triangle_;
  Nearest& nearest_;
  float limit_;  // may be below nearest_.limit: some triangle that waits is met before it for certain
  std::array<Waiting, capacity> waiting_;
  std::size_t count_ = 0;
};

class ToOpaque {
 public:
  ToOpaque(const OwnedTriangles& triangles, const World& world, const geometry::PreparedRay& ray,
           const FloatRay& float_ray, const SurfaceId& self, double limit, Crossed& crossed)
      : triangles_(triangles),
        world_(world),
        ray_(ray),
        float_ray_(float_ray),
        self_(self),
        self_triangle_(triangles.index(self)),
        exact_limit_(limit),
        limit_(float_ray.limit(limit)),
        certain_limit_(rounded_down(limit - float_ray.t_start)),
        crossed_(crossed) {}

  float limit() const { return limit_; }

  bool triangles(const WideTree::TriangleBlock& block) {
    Meetings met;
    meet(block, float_ray_, limit_, met);
    for (unsigned hits = met.possible; hits != 0; hits &= hits - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(hits));
      const std::uint32_t triangle = block.triangle[lane];
      if (triangle == self_triangle_) continue;
      const bool is_certain = (met.certain >> lane & 1u) != 0 && met.t_high[lane] < certain_limit_;
      if (!is_certain && !intersect(triangles_[triangle], ray_, exact_limit_)) continue;
      const std::uint32_t item = triangles_.item(triangle);
      if (world_.items[item].is_opaque) return true;
      crossed_.add(item);
    }
    return false;
  }
  bool spheres(const WideTree::SphereBlock& block) {
    for (unsigned hits = meet(block, float_ray_, limit_); hits != 0; hits &= hits - 1) {
      if (other(block.item[std::countr_zero(hits)])) return true;
    }
    return false;
  }
  bool other(std::uint32_t item) { return cross_item(world_, item, ray_, self_, exact_limit_, crossed_); }

 private:
  const OwnedTriangles& triangles_;
  const World& world_;
  const geometry::PreparedRay& ray_;
  const FloatRay& float_ray_;
  const SurfaceId& self_;
  std::uint32_t self_triangle_;
  double exact_limit_;
  float limit_, certain_limit_;
  Crossed& crossed_;
};

void find_nearest(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                  const geometry::PreparedRay& ray, const SurfaceId& self, Nearest& nearest) {
  const FloatRay float_ray(tree, ray);
  ToNearest visitor(triangles, world, ray, float_ray, self, nearest);
  walk_ray(tree, float_ray, visitor);
  visitor.decide();
}

bool find_opaque(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                 const geometry::PreparedRay& ray, const SurfaceId& self, double limit, Crossed& crossed) {
  const FloatRay float_ray(tree, ray);
  ToOpaque visitor(triangles, world, ray, float_ray, self, limit, crossed);
  return walk_ray(tree, float_ray, visitor);
}

/// A shaft in single precision, and its apex, both relative to a tree's origin.
struct FloatShaft {
  Shaft::BoxPlanes planes;
  float apex[3], error;

  FloatShaft(const WideTree& tree, const Shaft& shaft) : planes(shaft.box_planes(tree.origin())) {
    const Vec3 from = shaft.apex() - tree.origin();
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
HWY_INLINE std::pair<V, V> value_at(const Shaft::BoxPlanes::Plane& plane, const Vector3<V>& at) {
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
  const auto along = hn::MulAdd(x, hn::Load(d, cones.axis[0] + lane),
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
  const Shaft::BoxPlanes& planes = shaft.planes;
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
      const Shaft::BoxPlanes::Plane& far = planes.plane[planes.far];
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
  const Shaft::BoxPlanes& planes = shaft.planes;
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
      outside = hn::Or(outside, hn::And(hn::Gt(value_a, error_a), hn::And(hn::Gt(value_b, error_b), hn::Gt(value_c, error_c))));
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
    const Vector3<decltype(hn::Zero(d))> centre{hn::Load(d, block.center[0] + lane), hn::Load(d, block.center[1] + lane),
                                                hn::Load(d, block.center[2] + lane)};
    const auto radius = hn::Mul(hn::Load(d, block.radius + lane), hn::Set(d, 1 + 8 * roundoff));
    auto outside = hn::IsNaN(radius);
    for (int i = 0; i < shaft.planes.count; ++i) {
      const Shaft::BoxPlanes::Plane& plane = shaft.planes.plane[i];
      const auto [value, error] = value_at(plane, centre);
      outside = hn::Or(outside, hn::Gt(value, hn::MulAdd(radius, hn::Set(d, plane.length), error)));
    }
    hits |= bits(d, hn::Not(outside)) << lane;
  }
  return hits;
}

bool walk_shaft(const WideTree& tree, const NormalCones* cones, const Shaft& shaft, ShaftVisitor& visitor) {
  const FloatShaft float_shaft(tree, shaft);
  std::uint32_t stack[stack_size];
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

HWY_EXPORT(find_nearest);
HWY_EXPORT(find_opaque);
HWY_EXPORT(walk_shaft);

void walk_to_nearest(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                     const geometry::PreparedRay& ray, const SurfaceId& self, Nearest& nearest) {
  HWY_DYNAMIC_DISPATCH(find_nearest)(tree, triangles, world, ray, self, nearest);
}

bool walk_to_opaque(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                    const geometry::PreparedRay& ray, const SurfaceId& self, double limit, Crossed& crossed) {
  return HWY_DYNAMIC_DISPATCH(find_opaque)(tree, triangles, world, ray, self, limit, crossed);
}

bool walk(const WideTree& tree, const NormalCones* cones, const Shaft& shaft, ShaftVisitor& visitor) {
  return HWY_DYNAMIC_DISPATCH(walk_shaft)(tree, cones, shaft, visitor);
}

}  // namespace penumbra::accel
#endif
