#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <utility>

#include "engine/geometry/surface.h"
#include "engine/sampling/patterns.h"
#include "engine/shading/shading_point.h"

namespace penumbra::shading {

/// So many points at most are lit together, each in a lane: one for each place of sampling::DiscSpirals.
inline constexpr std::size_t lane_count = sampling::DiscSpirals::places;
using LaneMask = std::uint32_t;  // a bit for each lane

/// What `of_index` makes of each of `count` indices.
template <std::size_t count, class OfIndex>
auto array_of(const OfIndex& of_index) {
  return [&]<std::size_t... i>(std::index_sequence<i...>) { return std::array{of_index(i)...}; }
  (std::make_index_sequence<count>());
}

/// A vector in each lane.
struct Lanes3 {
  alignas(64) double x[lane_count], y[lane_count], z[lane_count];
  Vec3 operator[](std::size_t lane) const { return {x[lane], y[lane], z[lane]}; }
  void set(std::size_t lane, const Vec3& v) { x[lane] = v.x, y[lane] = v.y, z[lane] = v.z; }
};

/// Where in the picture a point is seen, in pixels.
struct PixelPlace {
  double x = 0, y = 0;
};

/// Points that pixels side by side see, to be lit together.
class PointBatch {
 public:
  PointBatch() {}  // what is not in use is not set

  /// Adds a point; there must be a lane left. Returns its lane: pixels of a square of four by four get lanes that
  /// spread the points of sampling::DiscSpirals well over the square.
  std::size_t add(const ShadingPoint& point, const PixelPlace& pixel) {
    const auto within = [](double place) { return static_cast<std::size_t>(static_cast<int>(place)) % 4; };
    std::size_t lane = lane_of_pixel[within(pixel.y)][within(pixel.x)];
    while ((used_ >> lane & 1) != 0) lane = (lane + 1) % lane_count;
    points_[lane] = point, pixels_[lane] = pixel;
    used_ |= LaneMask{1} << lane;
    if (point.material->is_lit) lit_ |= LaneMask{1} << lane;
    set(lane, point);
    return lane;
  }
  /// To be called once all are added: unused lanes then hold the point of a lane in use.
  void fill_unused() {
    if (used_ == 0 || used_ == all_lanes) return;
    const ShadingPoint& any = points_[static_cast<std::size_t>(std::countr_zero(used_))];
    for (std::size_t lane = 0; lane < lane_count; ++lane) {
      if ((used_ >> lane & 1) == 0) set(lane, any);
    }
  }
  LaneMask lit() const { return lit_; }  // the material sends on some light
  const ShadingPoint& point(std::size_t lane) const { return points_[lane]; }
  const PixelPlace& pixel(std::size_t lane) const { return pixels_[lane]; }

  Lanes3 position, facing, normal, view;  // as in ShadingPoint, with the shading normal

 private:
  static constexpr std::array<std::array<std::uint8_t, 4>, 4> lane_of_pixel{
      std::array<std::uint8_t, 4>{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
  void set(std::size_t lane, const ShadingPoint& point) {
    position.set(lane, point.surface.position), facing.set(lane, point.facing);
    normal.set(lane, point.surface.shading_normal), view.set(lane, point.view);
  }
  static constexpr LaneMask all_lanes = (LaneMask{1} << lane_count) - 1;
  union {
    std::array<ShadingPoint, lane_count> points_;
  };
  union {
    std::array<PixelPlace, lane_count> pixels_;
  };
  LaneMask used_ = 0, lit_ = 0;
};

/// Calls use(lane) for each lane in `mask`, the first lane first.
template <class Use>
void for_each_lane(LaneMask mask, const Use& use) {
  for (; mask != 0; mask &= mask - 1) use(static_cast<std::size_t>(std::countr_zero(mask)));
}

}  // namespace penumbra::shading
