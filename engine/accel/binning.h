#pragma once
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>

#include "engine/math/constants.h"

namespace penumbra::accel {

/// What the builder of a wide tree bins, and how it chooses splits: Wald, "On fast Construction of SAH-based Bounding
/// Volume Hierarchies", 2007.
inline constexpr std::size_t bin_count = 16;

enum class Shape : std::uint32_t { triangle, sphere, other };

/// The compiler's own vectors: four lanes are in every instruction set.
using Floats [[gnu::vector_size(16)]] = float;
using Integers [[gnu::vector_size(16)]] = std::int32_t;
inline Floats min(Floats a, Floats b) { return a < b ? a : b; }

/// The box of lower corner and negated upper corner: including is a minimum. The fourth lane of each is spare.
struct Box {
  Floats lower{math::float_infinity, math::float_infinity, math::float_infinity, 0}, minus_upper = lower;

  void include(const Box& box) { lower = min(box.lower, lower), minus_upper = min(box.minus_upper, minus_upper); }
  float width(int axis) const { return -minus_upper[axis] - lower[axis]; }
  float half_area() const { return width(0) * width(1) + width(1) * width(2) + width(2) * width(0); }
};

/// Box of an entry, and in the spare lanes which entry it is.
struct Reference {
  Box box;
  std::uint32_t index() const { return std::bit_cast<std::uint32_t>(box.lower[3]); }
  Shape shape() const { return static_cast<Shape>(std::bit_cast<std::uint32_t>(box.minus_upper[3])); }
  float doubled_center(int axis) const { return box.lower[axis] - box.minus_upper[axis]; }
};

using Range = std::span<Reference>;

/// Of a range: its box, and the box of its entries' (doubled) centers.
struct Extent {
  Box box, centers;
  std::size_t others = 0;
  void include(const Extent& e) { box.include(e.box), centers.include(e.centers), others += e.others; }
};
Extent extent_of(Range range);

/// Of the entries in each bin, by axis: their box and how many there are.
struct Bins {
  Box box[bin_count][3];
  Integers count[bin_count]{};  // the fourth is spare
  void include(const Bins& other);
};

/// Maps (doubled) centers to bins.
struct Binning {
  Floats lower{}, scale{};
  explicit Binning(const Box& centers) {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = centers.lower[axis];
      const float s = static_cast<float>(bin_count) / centers.width(axis);
      scale[axis] = std::isfinite(s) ? s : 0;
    }
  }
};
Bins bins_of(Range range, const Binning& binning);

struct Split {
  int axis = -1;
  int bin = 0;  // entries in bins below go left
  float cost = math::float_infinity;
};
Split best_split(const Bins& bins);

/// Writes the entries left of the split to the front of `to`, of the same size, and the others behind them, both in
/// their order. Needs the bins to tell how many go left, and tells it.
std::size_t partition(std::span<const Reference> range, const Binning& binning, const Bins& bins, const Split& split,
                      Reference* to);

}  // namespace penumbra::accel
