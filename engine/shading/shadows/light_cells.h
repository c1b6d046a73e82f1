#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/math/constants.h"
#include "engine/shading/scene.h"
#include "engine/shading/shading_point.h"
#include "engine/shading/shadows/cell.h"

namespace penumbra::shading::shadows {

/// What may stand between surfaces and lights, found once for the points of a cell some pixels wide: of a square on
/// flat surfaces, of a cube elsewhere. The grid's place and spacing depend on the point alone, so an answer does not
/// depend on what was asked before. One per thread.
class LightCells {
 public:
  explicit LightCells(const accel::World& world);

  /// The contents for this point and a light that lies inside `target`; `light` names the target. Nothing where there
  /// are no cells, or where they do not pay. An outline, if one is asked for, where there is no verdict. Valid until
  /// the next call.
  const CellContents* find(const ShadingPoint& at, std::size_t light, const Target& target, bool has_outline);

 private:
  /// Where a cell is and what it belongs to. Cubes belong to no surface.
  struct Key {
    geometry::SurfaceId surface;
    std::uint32_t light = 0;
    std::int16_t level = 0;  // the spacing is 2^level
    bool is_flat = false, is_outlined = false, is_facing_normal = false;
    std::int64_t row = 0, column = 0, layer = 0;
    bool operator==(const Key&) const = default;
    /// Of where the cell is, whatever the light.
    std::uint64_t place_hash() const;
  };
  struct Entry {
    Key key;
    CellContents contents;
  };
  /// Fills key_ (the light aside); false where there are no cells.
  bool locate(const ShadingPoint& at);
  bool locate_flat(const ShadingPoint& at);
  bool locate_round(const ShadingPoint& at);
  /// For cells no wider than this; false where they would be little wider than rounding.
  bool set_level(double width);
  std::int64_t row_of(double coordinate) const;
  /// Notes the surface, and of flat ones what locate_flat and flat_cell want to know.
  void face(const ShadingPoint& at);
  const CellContents& contents(const Target& target);  // of key_
  FlatCell flat_cell() const;                          // of key_
  RoundCell round_cell() const;

  static constexpr std::size_t capacity = 4096;
  static constexpr std::uint16_t none = 0xffff;
  const accel::World& world_;
  bool has_round_cells_;
  std::array<std::uint16_t, capacity> places_;  // in entries_, by hash
  std::vector<Entry> entries_;
  std::size_t held_ = 0;               // edges, spheres and others
  std::size_t asked_ = 0, built_ = 0;  // contents, since they were last compared
  std::size_t resting_ = 0;            // questions left to be turned down
  // Of the point last asked for:
  Vec3 position_{math::infinity, math::infinity, math::infinity}, facing_;
  geometry::SurfaceId surface_;
  Key key_;
  std::uint64_t place_hash_ = 0;
  bool is_located_ = false;
  double spacing_ = 1, per_spacing_ = 1;  // 2^level and its reciprocal
  bool is_flat_ = false, is_facing_normal_ = false;
  int up_ = 0;         // the axis nearest to the normal
  Vec3 origin_;        // a point of the plane
  double extent_ = 0;  // how far the surface goes along some axis
};

}  // namespace penumbra::shading::shadows
