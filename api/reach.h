#pragma once
#include <span>

#include "engine/math/affine.h"
#include "engine/scene/shapes.h"

namespace penumbra::api {

/// How far something reaches from the origin, and how small it is.
struct Reach {
  math::Vec3 farthest;  // the largest coordinates, whatever their signs
  double size = 0;      // 0 for what has none, or is a single point

  /// Whether it keeps to `largest_length` and `smallest_length`.
  bool is_within_limits() const;
};

Reach reach_of(std::span<const math::Vec3> points);
/// Of what has a place of its own: nothing for an instance, and a group.
Reach reach_of(const scene::Shape& shape);
/// After `placement`.
Reach placed(const Reach& reach, const math::Affine& placement);

}  // namespace penumbra::api
