#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>

namespace penumbra::accel {

/// What the builder of a wide tree bins, and how it chooses splits: Wald, "On fast Construction of SAH-based Bounding
/// Volume Hierarchies", 2007.
inline constexpr std::size_t bin_count = 16;

enum class Shape : std::uint32_t { triangle, sphere, other };

/// The box of lower corner and negated upper corner: including is a minimum. The fourth lane of each is spare.
struct Box {
  float lower[4]{HUGE_VALF, HUGE_VALF, HUGE_VALF, 0}, minus_upper[4]{HUGE_VALF, HUGE_VALF, HUGE_VALF, 0};

  void include(const float* low, const float* minus_high) {
    for (int i = 0; i < 4; ++i) lower[i] = low[i] < lower[i] ? low[i] : lower[i];
    for (int i = 0; i < 4; ++i) minus_upper[i] = minus_high[i] < minus_upper[i] ? minus_high[i] : minus_upper[i];
  }
  void include(const Box& box) { include(box.lower, box.minus_upper); }
  float width(int axis) const { return -minus_upper[axis] - lower[axis]; }
  float half_area() const { return width(0) * width(1) + width(1) * width(2) + width(2) * width(0); }
};

/// Box of an entry, and in the spare lanes which entry it is.
struct Reference {
  float lower[4], minus_upper[4];
  std::uint32_t index() const { return std::bit_cast<std::uint32_t>(lower[3]); }
  Shape shape() const { return static_cast<Shape>(std::bit_cast<std::uint32_t>(minus_upper[3])); }
  float doubled_centre(int axis) const { return lower[axis] - minus_upper[axis]; }
};

using Range = std::span<Reference>;

/// Of a range: its box, and the box of its entries' (doubled) centres.
struct Extent {
  Box box, centres;
  std::size_t others = 0;
  void include(const Reference& r) {
    box.include(r.lower, r.minus_upper);
    const float c[4]{r.doubled_centre(0), r.doubled_centre(1), r.doubled_centre(2), 0};
    const float minus[4]{-c[0], -c[1], -c[2], 0};
    centres.include(c, minus);
    others += r.shape() == Shape::other ? 1 : 0;
  }
  void include(const Extent& e) { box.include(e.box), centres.include(e.centres), others += e.others; }
};

struct Bins {
  std::array<std::array<Box, bin_count>, 3> box;
  std::array<std::array<std::uint32_t, bin_count>, 3> count{};
};

struct Split {
  int axis = -1;
  int bin = 0;  // entries in bins below go left
  float cost = HUGE_VALF;
};

/// Maps (doubled) centres to bins.
struct Binning {
  float lower[3], scale[3];
  explicit Binning(const Box& centres) {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = centres.lower[axis];
      const float s = static_cast<float>(bin_count) / centres.width(axis);
      scale[axis] = std::isfinite(s) ? s : 0;
    }
  }
  std::size_t bin(const Reference& r, int axis) const {
    const float x = (r.doubled_centre(axis) - lower[axis]) * scale[axis];
    return std::min(bin_count - 1, static_cast<std::size_t>(x));
  }
};

inline Split best_split(const Bins& bins, const Binning& binning, std::size_t total) {
  Split best;
  for (int axis = 0; axis < 3; ++axis) {
    if (binning.scale[axis] == 0) continue;
    const auto& box = bins.box[static_cast<std::size_t>(axis)];
    const auto& count = bins.count[static_cast<std::size_t>(axis)];
    std::array<float, bin_count> cost_left{};
    Box side;
    std::size_t entries = 0;
    for (std::size_t i = 0; i + 1 < bin_count; ++i) {
      side.include(box[i]), entries += count[i];
      cost_left[i + 1] = entries == 0 ? HUGE_VALF : side.half_area() * static_cast<float>(entries);
    }
    side = {}, entries = 0;
    for (std::size_t i = bin_count - 1; i >= 1; --i) {
      side.include(box[i]), entries += count[i];
      if (entries == 0 || entries == total) continue;
      const float cost = cost_left[i] + side.half_area() * static_cast<float>(entries);
      if (cost < best.cost) best = {axis, static_cast<int>(i), cost};
    }
  }
  return best;
}

}  // namespace penumbra::accel
