#pragma once
#include <array>
#include <cstdint>

#include "engine/accel/hit.h"
#include "engine/geometry/triangle.h"
#include "engine/math/vec3.h"

namespace penumbra::accel {

/// So many rays at most go one way through a structure together.
inline constexpr std::size_t bundle_width = 8;

/// Rays side by side, and what each leaves: those that lie close together and go into one octant share most of the way
/// through the structure.
class Bundle {
 public:
  /// Adds a ray; there must be room left.
  void add(const math::Vec3& origin, const math::Vec3& direction, const SurfaceId& self = {}) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto row = static_cast<std::size_t>(axis);
      origin_[row][size_] = origin[axis], direction_[row][size_] = direction[axis];
    }
    selves_[size_++] = self;
  }
  void clear() { size_ = 0; }
  std::size_t size() const { return size_; }
  math::Vec3 origin(std::size_t i) const { return {origin_[0][i], origin_[1][i], origin_[2][i]}; }
  math::Vec3 direction(std::size_t i) const { return {direction_[0][i], direction_[1][i], direction_[2][i]}; }
  const SurfaceId& self(std::size_t i) const { return selves_[i]; }
  geometry::PreparedRay prepared(std::size_t i) const { return {origin(i), direction(i)}; }

  /// By axis and ray, for SIMD: those beyond `size` are left over from others.
  const double* origins(std::size_t axis) const { return origin_[axis].data(); }
  const double* directions(std::size_t axis) const { return direction_[axis].data(); }

 private:
  using Lanes = std::array<double, bundle_width>;
  alignas(64) std::array<Lanes, 3> origin_{}, direction_{};
  std::array<SurfaceId, bundle_width> selves_;
  std::size_t size_ = 0;
};

}  // namespace penumbra::accel
