#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/accel/nearest_walk.cpp"
#include "engine/accel/simd-inl.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "engine/accel/ray_bundle-inl.h"
#include "engine/accel/wide_walk.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using simd::HWY_NAMESPACE::bits;

struct Pending {
  std::uint32_t child;
  float near;
};

/// Visits what of `current` the ray may meet before `visitor.limit()`, roughly nearest first.
template <class Visitor>
HWY_INLINE void walk_in_order(const WideTree& tree, std::uint32_t current, const FloatRay& ray, Visitor& visitor) {
  Pending stack[WideTree::stack_size];
  std::size_t count = 0;
  while (true) {
    if (WideTree::sort_of(current) == WideTree::Sort::node) {
      const WideTree::Node& node = tree.nodes()[current];
      HWY_ALIGN float near[WideTree::width];
      unsigned hits = enter<true>(node, ray, visitor.limit(), near);
      if (hits != 0) {
        const auto first_lane = static_cast<std::size_t>(std::countr_zero(hits));
        hits &= hits - 1;
        if (hits == 0) {
          current = node.child[first_lane];
          continue;
        }
        std::size_t nearest = first_lane;
        for (; hits != 0; hits &= hits - 1) {
          const auto i = static_cast<std::size_t>(std::countr_zero(hits));
          const std::size_t both = i ^ nearest;
          nearest ^= near[i] < near[nearest] ? both : 0;
          stack[count++] = {node.child[nearest ^ both], near[nearest ^ both]};
        }
        current = node.child[nearest];
        continue;
      }
    } else {
      visit_leaf(tree, current, visitor);
    }
    do {
      if (count == 0) return;
      --count;
    } while (stack[count].near > visitor.limit());
    current = stack[count].child;
  }
}

/// Keeps triangles that may be nearest until the walk is over: then few are left to test in double precision.
class ToNearest {
 public:
  ToNearest(const Walk& walk, Nearest& nearest)
      : walk_(walk),
        self_triangle_(walk.triangles.index(walk.self)),
        nearest_(nearest),
        limit_(walk.float_ray.limit(nearest.limit)) {}

  float limit() const { return limit_; }

  bool triangles(const WideTree::TriangleBlock& block) {
    Meetings met;
    meet<true>(block, walk_.float_ray, limit_, met);
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
    for (unsigned hits = meet(block, walk_.float_ray, limit_); hits != 0; hits &= hits - 1) {
      other(block.item[std::countr_zero(hits)]);
    }
    return false;
  }
  bool other(std::uint32_t item) {
    find_in_item(walk_.world, item, walk_.ray(), walk_.self, nearest_);
    limit_ = std::min(limit_, walk_.float_ray.limit(nearest_.limit));
    return false;
  }

  /// The one triangle that is waiting, if it is met for certain and no other is; else OwnedTriangles::none.
  std::uint32_t certain() {
    std::size_t left = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (!(waiting_[i].t_low > limit_)) waiting_[left++] = waiting_[i];
    }
    count_ = left;
    return left == 1 && waiting_[0].is_certain ? waiting_[0].triangle : OwnedTriangles::none;
  }
  void offer(std::uint32_t triangle, double t, double b1, double b2) {
    nearest_.offer({t, walk_.triangles.surface(triangle), b1, b2});
  }

  /// Tests what is waiting.
  void decide() {
    for (std::size_t i = 0; i < count_; ++i) {
      if (waiting_[i].t_low > limit_) continue;
      const std::uint32_t triangle = waiting_[i].triangle;
      const std::optional<geometry::TriangleHit> hit =
          waiting_[i].is_certain ? intersect_certainly(walk_.triangles[triangle], walk_.ray())
                                 : intersect(walk_.triangles[triangle], walk_.ray(), nearest_.limit);
      if (!hit) continue;
      nearest_.offer({hit->t, walk_.triangles.surface(triangle), hit->b1, hit->b2});
      limit_ = std::min(limit_, walk_.float_ray.limit(nearest_.limit));
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
  const Walk& walk_;
  std::uint32_t self_triangle_;
  Nearest& nearest_;
  float limit_;  // may be below nearest_.limit: some triangle that waits is met before it for certain
  std::array<Waiting, capacity> waiting_;
  std::size_t count_ = 0;
};

void find_nearest(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                  const geometry::PreparedRay& ray, const SurfaceId& self, Nearest& nearest) {
  const FloatRay float_ray(tree, ray);
  const Walk context{triangles, world, ExactRay(ray), float_ray, self};
  ToNearest visitor(context, nearest);
  walk_in_order(tree, tree.root(), float_ray, visitor);
  visitor.decide();
}

/// The rays that have not yet met something for certain before t.
HWY_INLINE unsigned reaching(float t, const FloatBundle& bundle) {
  const Floats d;
  unsigned rays = 0;
  for (std::size_t lane = 0; lane < bundle_width; lane += hn::Lanes(d))
    rays |= bits(d, hn::Ge(hn::Load(d, bundle.limit + lane), hn::Set(d, t))) << lane;
  return rays;
}

/// As walk_in_order, with the rays whose bits are set, all of one octant. One that is left alone goes on alone.
HWY_INLINE void walk_bundle_in_order(const WideTree& tree, FloatBundle& bundle, unsigned all,
                                     std::array<ToNearest, bundle_width>& visitors) {
  struct Part {
    std::uint32_t child;
    unsigned rays;
    float near;
  };
  Part stack[WideTree::stack_size];
  std::size_t count = 0;
  stack[count++] = {tree.root(), all, 0};
  while (count > 0) {
    const Part part = stack[--count];
    unsigned rays = part.rays & reaching(part.near, bundle);
    if (rays == 0) continue;
    if (std::has_single_bit(rays)) {
      const auto ray = static_cast<std::size_t>(std::countr_zero(rays));
      walk_in_order(tree, part.child, bundle.rays[ray], visitors[ray]);
      bundle.limit[ray] = visitors[ray].limit();
      continue;
    }
    if (WideTree::sort_of(part.child) == WideTree::Sort::node) {
      const WideTree::Node& node = tree.nodes()[part.child];
      const std::size_t first = count;
      for (std::size_t child = 0; child < WideTree::width; ++child) {
        float near;
        const unsigned entered = enter<true>(node, child, bundle, &near) & rays;
        if (entered == 0) continue;
        std::size_t place = count++;
        for (; place > first && stack[place - 1].near < near; --place) stack[place] = stack[place - 1];
        stack[place] = {node.child[child], entered, near};
      }
      continue;
    }
    for (; rays != 0; rays &= rays - 1) {
      const auto ray = static_cast<std::size_t>(std::countr_zero(rays));
      visit_leaf(tree, part.child, visitors[ray]);
      bundle.limit[ray] = visitors[ray].limit();
    }
  }
}

/// Triangles side by side that rays meet for certain: geometry::intersect_certainly, lane by lane.
struct CertainHits {
  alignas(64) double vertex[3][3][bundle_width];  // by vertex and axis of the sheared space
  alignas(64) double origin[3][bundle_width], shear[3][bundle_width];
  alignas(64) double t[bundle_width], b1[bundle_width], b2[bundle_width];

  void set(std::size_t lane, const geometry::TriangleVertices& triangle, const Bundle& bundle, std::size_t ray,
           const int* axes) {
    const math::Vec3* vertices[3]{&triangle.v0, &triangle.v1, &triangle.v2};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<std::size_t>(axes[k]);
      for (std::size_t v = 0; v < 3; ++v) vertex[v][k][lane] = (*vertices[v])[axes[k]];
      origin[k][lane] = bundle.origins(axis)[ray], shear[k][lane] = bundle.directions(axis)[ray];
    }
  }

  void find() {
    const hn::CappedTag<double, bundle_width> d;
    for (std::size_t lane = 0; lane < bundle_width; lane += hn::Lanes(d)) {
      const auto shear_z = hn::Div(hn::Set(d, 1.0), hn::Load(d, shear[2] + lane));
      const auto shear_x = hn::Mul(hn::Load(d, shear[0] + lane), shear_z),
                 shear_y = hn::Mul(hn::Load(d, shear[1] + lane), shear_z);
      const auto relative = [&](std::size_t v, std::size_t axis) HWY_ATTR {
        return hn::Sub(hn::Load(d, vertex[v][axis] + lane), hn::Load(d, origin[axis] + lane));
      };
      const auto az = relative(0, 2), bz = relative(1, 2), cz = relative(2, 2);
      const auto x = [&](std::size_t v, auto z) HWY_ATTR { return hn::Sub(relative(v, 0), hn::Mul(shear_x, z)); };
      const auto y = [&](std::size_t v, auto z) HWY_ATTR { return hn::Sub(relative(v, 1), hn::Mul(shear_y, z)); };
      const auto ax = x(0, az), ay = y(0, az), bx = x(1, bz), by = y(1, bz), cx = x(2, cz), cy = y(2, cz);
      const auto u = hn::Sub(hn::Mul(cx, by), hn::Mul(cy, bx)), v = hn::Sub(hn::Mul(ax, cy), hn::Mul(ay, cx)),
                 w = hn::Sub(hn::Mul(bx, ay), hn::Mul(by, ax));
      const auto inverse = hn::Div(hn::Set(d, 1.0), hn::Add(hn::Add(u, v), w));
      const auto sum = hn::Add(hn::Add(hn::Mul(u, hn::Mul(shear_z, az)), hn::Mul(v, hn::Mul(shear_z, bz))),
                               hn::Mul(w, hn::Mul(shear_z, cz)));
      hn::Store(hn::Mul(sum, inverse), d, t + lane);
      hn::Store(hn::Mul(v, inverse), d, b1 + lane), hn::Store(hn::Mul(w, inverse), d, b2 + lane);
    }
  }
};

/// Tests what waits for each ray: a single triangle that is met for certain, as most meet, together with others.
HWY_INLINE void decide(const OwnedTriangles& triangles, const Bundle& together, const FloatBundle& bundle,
                       std::array<ToNearest, bundle_width>& visitors) {
  CertainHits hits;
  std::uint32_t certain[bundle_width];
  unsigned in_lanes = 0;
  for (std::size_t i = 0; i < together.size(); ++i) {
    certain[i] = visitors[i].certain();
    if (certain[i] == OwnedTriangles::none) {
      visitors[i].decide();
      continue;
    }
    const geometry::TriangleVertices triangle = triangles[certain[i]];
    for (std::size_t lane = 0; lane < bundle_width && in_lanes == 0; ++lane)
      hits.set(lane, triangle, together, i, bundle.rays[i].axis);
    if (in_lanes != 0) hits.set(i, triangle, together, i, bundle.rays[i].axis);
    in_lanes |= 1u << i;
  }
  if (in_lanes == 0) return;
  hits.find();
  for (; in_lanes != 0; in_lanes &= in_lanes - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(in_lanes));
    visitors[i].offer(certain[i], hits.t[i], hits.b1[i], hits.b2[i]);
  }
}

void find_nearest_of_bundle(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                            const Bundle& together, Nearest* nearest) {
  FloatBundle bundle(tree, together);
  const std::size_t count = together.size(), last = count - 1;
  const auto walks = for_each_ray([&](std::size_t i) {
    const std::size_t ray = std::min(i, last);
    return Walk{triangles, world, ExactRay(together, ray), bundle.rays[ray], together.self(ray)};
  });
  auto visitors = for_each_ray([&](std::size_t i) { return ToNearest(walks[i], nearest[std::min(i, last)]); });
  for (std::size_t i = 0; i < count; ++i) bundle.limit[i] = visitors[i].limit();
  for_each_octant(bundle, count, [&](unsigned alike) { walk_bundle_in_order(tree, bundle, alike, visitors); });
  decide(triangles, together, bundle, visitors);
}

}  // namespace
}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace penumbra::accel {

HWY_EXPORT(find_nearest);
HWY_EXPORT(find_nearest_of_bundle);

void walk_to_nearest(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                     const geometry::PreparedRay& ray, const SurfaceId& self, Nearest& nearest) {
  HWY_DYNAMIC_DISPATCH(find_nearest)(tree, triangles, world, ray, self, nearest);
}

void walk_to_nearest(const WideTree& tree, const OwnedTriangles& triangles, const World& world, const Bundle& bundle,
                     Nearest* nearest) {
  HWY_DYNAMIC_DISPATCH(find_nearest_of_bundle)(tree, triangles, world, bundle, nearest);
}

}  // namespace penumbra::accel
#endif
