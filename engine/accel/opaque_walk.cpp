#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/accel/opaque_walk.cpp"
#include "engine/accel/simd-inl.h"

#include <algorithm>
#include <bit>

#include "engine/accel/ray_bundle-inl.h"
#include "engine/accel/wide_walk.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// Visits what of `current` the ray may meet before `visitor.limit()`, in any order; true if the visitor ended it.
template <class Visitor>
HWY_INLINE bool walk_to_end(const WideTree& tree, std::uint32_t current, const FloatRay& ray, Visitor& visitor) {
  std::uint32_t stack[WideTree::stack_size];
  std::size_t count = 0;
  while (true) {
    if (WideTree::sort_of(current) == WideTree::Sort::node) {
      const WideTree::Node& node = tree.nodes()[current];
      unsigned hits = enter<false>(node, ray, visitor.limit(), nullptr);
      if (hits != 0) {
        current = node.child[std::countr_zero(hits)];
        for (hits &= hits - 1; hits != 0; hits &= hits - 1) stack[count++] = node.child[std::countr_zero(hits)];
        continue;
      }
    } else if (visit_leaf(tree, current, visitor)) {
      return true;
    }
    if (count == 0) return false;
    current = stack[--count];
  }
}

class ToOpaque {
 public:
  ToOpaque(const Walk& walk, double limit, Crossed& crossed)
      : walk_(walk),
        self_triangle_(walk.triangles.index(walk.self)),
        exact_limit_(limit),
        limit_(walk.float_ray.limit(limit)),
        certain_limit_(rounded_down(limit - walk.float_ray.t_start)),
        crossed_(crossed) {}

  float limit() const { return limit_; }

  bool triangles(const WideTree::TriangleBlock& block) {
    Meetings met;
    meet<false>(block, walk_.float_ray, limit_, met);
    for (unsigned hits = met.possible; hits != 0; hits &= hits - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(hits));
      const std::uint32_t triangle = block.triangle[lane];
      if (triangle == self_triangle_) continue;
      const bool is_certain = (met.certain >> lane & 1u) != 0 && met.t_high[lane] < certain_limit_;
      if (!is_certain && !crosses(walk_.triangles[triangle], walk_.ray(), exact_limit_)) continue;
      if (walk_.triangles.is_opaque(triangle)) return true;
      crossed_.add(walk_.triangles.item(triangle));
    }
    return false;
  }
  bool spheres(const WideTree::SphereBlock& block) {
    for (unsigned hits = meet(block, walk_.float_ray, limit_); hits != 0; hits &= hits - 1) {
      if (other(block.item[std::countr_zero(hits)])) return true;
    }
    return false;
  }
  bool other(std::uint32_t item) {
    return cross_item(walk_.world, item, walk_.ray(), walk_.self, exact_limit_, crossed_);
  }

 private:
  const Walk& walk_;
  std::uint32_t self_triangle_;
  double exact_limit_;
  float limit_, certain_limit_;
  Crossed& crossed_;
};

bool find_opaque(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                 const geometry::PreparedRay& ray, const SurfaceId& self, double limit, Crossed& crossed) {
  const FloatRay float_ray(tree, ray);
  const Walk context{triangles, world, ExactRay(ray), float_ray, self};
  ToOpaque visitor(context, limit, crossed);
  return walk_to_end(tree, tree.root(), float_ray, visitor);
}

/// Fewer than so many rays ask for all children one after the other, more of them for each child together.
constexpr int many_rays = 5;

/// Walks with the rays whose bits are set in `alive`, all of one octant; returns those that no visitor ended. One that
/// is left alone goes on alone.
HWY_INLINE unsigned walk_bundle(const WideTree& tree, const FloatBundle& bundle, unsigned alive,
                                std::array<ToOpaque, bundle_width>& visitors) {
  struct Part {
    std::uint32_t child;
    unsigned rays;
  };
  Part stack[WideTree::stack_size];
  std::size_t count = 0;
  stack[count++] = {tree.root(), alive};
  while (count > 0) {
    const Part part = stack[--count];
    unsigned rays = part.rays & alive;
    if (rays == 0) continue;
    if (std::has_single_bit(rays)) {
      const auto ray = static_cast<std::size_t>(std::countr_zero(rays));
      if (walk_to_end(tree, part.child, bundle.rays[ray], visitors[ray])) alive &= ~rays;
      continue;
    }
    if (WideTree::sort_of(part.child) == WideTree::Sort::node) {
      const WideTree::Node& node = tree.nodes()[part.child];
      if (std::popcount(rays) < many_rays) {
        unsigned entered[WideTree::width]{}, any = 0;
        for (; rays != 0; rays &= rays - 1) {
          const int ray = std::countr_zero(rays);
          const auto i = static_cast<std::size_t>(ray);
          const unsigned hits = enter<false>(node, bundle.rays[i], visitors[i].limit(), nullptr);
          any |= hits;
          for (unsigned rest = hits; rest != 0; rest &= rest - 1) entered[std::countr_zero(rest)] |= 1u << ray;
        }
        for (; any != 0; any &= any - 1) {
          const int child = std::countr_zero(any);
          stack[count++] = {node.child[child], entered[child]};
        }
        continue;
      }
      for (std::size_t child = 0; child < WideTree::width; ++child) {
        const unsigned entered = enter<false>(node, child, bundle, nullptr) & rays;
        if (entered != 0) stack[count++] = {node.child[child], entered};
      }
      continue;
    }
    for (; rays != 0; rays &= rays - 1) {
      const int ray = std::countr_zero(rays);
      if (visit_leaf(tree, part.child, visitors[static_cast<std::size_t>(ray)])) alive &= ~(1u << ray);
    }
  }
  return alive;
}

unsigned find_opaque_in_bundle(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                               const Bundle& together, double limit, Crossed* crossed) {
  FloatBundle bundle(tree, together);
  const std::size_t count = together.size(), last = count - 1;
  const auto walks = for_each_ray([&](std::size_t i) {
    const std::size_t ray = std::min(i, last);
    return Walk{triangles, world, ExactRay(together, ray), bundle.rays[ray], together.self(ray)};
  });
  auto visitors = for_each_ray([&](std::size_t i) { return ToOpaque(walks[i], limit, crossed[std::min(i, last)]); });
  for (std::size_t i = 0; i < count; ++i) bundle.limit[i] = visitors[i].limit();
  unsigned blocked = 0;
  for_each_octant(bundle, count,
                  [&](unsigned alike) { blocked |= alike & ~walk_bundle(tree, bundle, alike, visitors); });
  return blocked;
}

}  // namespace
}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace penumbra::accel {

HWY_EXPORT(find_opaque);
HWY_EXPORT(find_opaque_in_bundle);

bool walk_to_opaque(const WideTree& tree, const OwnedTriangles& triangles, const World& world,
                    const geometry::PreparedRay& ray, const SurfaceId& self, double limit, Crossed& crossed) {
  return HWY_DYNAMIC_DISPATCH(find_opaque)(tree, triangles, world, ray, self, limit, crossed);
}

unsigned walk_to_opaque(const WideTree& tree, const OwnedTriangles& triangles, const World& world, const Bundle& bundle,
                        double limit, Crossed* crossed) {
  return HWY_DYNAMIC_DISPATCH(find_opaque_in_bundle)(tree, triangles, world, bundle, limit, crossed);
}

}  // namespace penumbra::accel
#endif
