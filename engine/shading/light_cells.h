#pragma once
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/accel/cell.h"
#include "engine/shading/scene.h"
#include "engine/shading/shading_point.h"

namespace penumbra::shading {

/// What may stand between flat surfaces and lights, found once for the points of a square cell some pixels wide. The
/// grid's place and spacing depend on the point alone, so an answer does not depend on what was asked before. One per
/// thread.
class LightCells {
 public:
  explicit LightCells(const accel::World& world) : world_(world) {}

  /// The contents for this point and a light that lies inside `target`; `light` names the target. Nothing where the
  /// point is on no large flat surface. Valid until the next call.
  const accel::CellContents* find(const ShadingPoint& at, std::size_t light, const accel::Target& target);

 private:
  struct Key {
    geometry::SurfaceId surface;
    std::uint32_t light = 0;
    std::int16_t level = 0;  // the spacing is 2^level
    bool is_facing_normal = false;
    std::int64_t row = 0, column = 0;
    bool operator==(const Key&) const = default;
    std::uint64_t hash() const;
  };
  struct Entry {
    Key key;
    bool is_used = false;
    accel::CellContents contents;
  };
  /// A point of the surface's plane, if it is flat and wider than `spacing`.
  /// Fills key_ (the light aside), spacing_ and up_; false where there are no cells.
  bool locate(const ShadingPoint& at);
  /// The cell that key_ names, for the side that the unit normal `up` points to; nothing on a small surface.
  std::optional<accel::Cell> cell(const Vec3& up) const;
  std::optional<Vec3> point_of_plane(const geometry::SurfaceId& surface, double spacing) const;

  static constexpr std::size_t capacity = 1024;
  const accel::World& world_;
  std::vector<Entry> entries_;
  // Of the point last asked for:
  Vec3 position_{HUGE_VAL, HUGE_VAL, HUGE_VAL}, facing_;
  Key key_;
  double spacing_ = 1;
  int up_ = 0;  // the axis nearest to the normal
  bool is_located_ = false;
};

}  // namespace penumbra::shading
