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
    find_in_item(walk_.world, item, walk_.ray, walk_.self, nearest_);
    limit_ = std::min(limit_, walk_.float_ray.limit(nearest_.limit));
    return false;
  }

  /// Tests what is waiting.
  void decide() {
    for (std::size_t i = 0; i < count_; ++i) {
      if (waiting_[i].t_low > limit_) continue;
      const std::uint32_t triangle = waiting_[i].triangle;
      const std::optional<geometry::TriangleHit> hit =
          waiting_[i].is_certain ? intersect_certainly(walk_.triangles[triangle], walk_.ray)
                                 : intersect(walk_.triangles[triangle], walk_.ray, nearest_.limit);
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
  const Walk context{triangles, world, ray, float_ray, self};
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
HWY_INLINE void walk_bundle_in_order(const WideTree& tree, const std::array<FloatRay, bundle_width>& float_rays,
                                     FloatBundle& bundle, unsigned all, std::array<ToNearest, bundle_width>& visitors) {
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
      walk_in_order(tree, part.child, float_rays[ray], visitors[ray]);
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

void find_nearest_of_bundle(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                            const Bundle& together, Nearest* nearest) {
  const auto& rays = together.rays;
  const std::size_t count = rays.size();
  const auto float_rays = for_each_lane(count, [&](std::size_t i) { return FloatRay(tree, rays[i]); });
  const auto walks = for_each_lane(count, [&](std::size_t i) {
    return Walk{triangles, world, rays[i], float_rays[i], together.selves[i]};
  });
  auto visitors = for_each_lane(count, [&](std::size_t i) { return ToNearest(walks[i], nearest[i]); });
  FloatBundle bundle;
  for (std::size_t i = 0; i < bundle_width; ++i) bundle.set(i, float_rays[i], visitors[i].limit());
  for_each_octant(float_rays, count, bundle,
                  [&](unsigned alike) { walk_bundle_in_order(tree, float_rays, bundle, alike, visitors); });
  for (std::size_t i = 0; i < count; ++i) visitors[i].decide();
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
