// Compiled once per instruction set; the best one the processor has is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/accel/nearest_walk.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "engine/accel/ray_tests-inl.h"
#include "engine/accel/wide_walk.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

struct Pending {
  std::uint32_t child;
  float near;
};

/// Visits what the ray may meet before `visitor.limit()`, roughly nearest first.
template <class Visitor>
HWY_INLINE void walk_in_order(const WideTree& tree, const FloatRay& ray, Visitor& visitor) {
  Pending stack[WideTree::stack_size];
  std::size_t count = 0;
  std::uint32_t current = tree.root();
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
      if (!hit || !(hit->t < nearest_.limit)) continue;
      nearest_.offer(hit->t, walk_.triangles.surface(triangle), hit->b1, hit->b2);
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
  walk_in_order(tree, float_ray, visitor);
  visitor.decide();
}

}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace penumbra::accel {

HWY_EXPORT(find_nearest);

void walk_to_nearest(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                     const geometry::PreparedRay& ray, const SurfaceId& self, Nearest& nearest) {
  HWY_DYNAMIC_DISPATCH(find_nearest)(tree, triangles, world, ray, self, nearest);
}

}  // namespace penumbra::accel
#endif
