#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/geometry/ray.h"

namespace penumbra::accel {

using geometry::SurfaceId;

/// The nearest crossing: t in units of the ray's direction; b1, b2 weigh the second and third vertex of a triangle.
struct Hit {
  double t = 0;
  SurfaceId surface;
  double b1 = 0, b2 = 0;
};

/// The items a segment crosses, once per crossing.
class Crossed {
 public:
  void clear() { items_.clear(); }
  void add(std::uint32_t item) { items_.push_back(item); }
  /// In scene order, so that products over them round the same way whatever structure found them.
  const std::vector<std::uint32_t>& sorted() {
    std::sort(items_.begin(), items_.end());
    return items_;
  }

 private:
  std::vector<std::uint32_t> items_;
};

}  // namespace penumbra::accel
