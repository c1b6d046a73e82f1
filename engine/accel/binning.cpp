#include "engine/accel/binning.h"

#include "engine/math/constants.h"

namespace penumbra::accel {
namespace {

/// As Reference::doubled_center; nothing in the spare lane, where arithmetic on what is no number would be slow.
Floats doubled_center(const Reference& r) {
  constexpr Integers used{-1, -1, -1, 0};
  const auto kept = [&](Floats v) { return std::bit_cast<Floats>(std::bit_cast<Integers>(v) & used); };
  return kept(r.box.lower) - kept(r.box.minus_upper);
}

/// Half the area of the box of each axis, in that axis's lane.
Floats half_areas(const Box* side) {
  // A width is the sum of both, negated; two negations cancel.
  const Floats a = side[0].minus_upper + side[0].lower, b = side[1].minus_upper + side[1].lower,
               c = side[2].minus_upper + side[2].lower;
  const Floats ab_xy = __builtin_shufflevector(a, b, 0, 4, 1, 5), ab_z = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Floats x = __builtin_shufflevector(ab_xy, c, 0, 1, 4, 7), y = __builtin_shufflevector(ab_xy, c, 2, 3, 5, 7),
               z = __builtin_shufflevector(ab_z, c, 0, 1, 6, 7);
  return x * y + y * z + z * x;
}

}  // namespace

Extent extent_of(Range range) {
  Extent extent;
  Box box, centers;
  for (const Reference& r : range) {
    box.include(r.box);
    const Floats c = doubled_center(r);
    centers.include({c, -c});
    extent.others += r.shape() == Shape::other ? 1 : 0;
  }
  extent.box = box, extent.centers = centers;
  return extent;
}

void Bins::include(const Bins& other) {
  for (std::size_t i = 0; i < bin_count; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) box[i][axis].include(other.box[i][axis]);
    count[i] += other.count[i];
  }
}

Bins bins_of(Range range, const Binning& binning) {
  Bins bins;
  constexpr float last = bin_count - 1;
  for (const Reference& r : range) {
    const Floats x = (doubled_center(r) - binning.lower) * binning.scale;
    const auto bin = __builtin_convertvector(min(x, Floats{last, last, last, last}), Integers);
    for (int axis = 0; axis < 3; ++axis) {
      bins.box[bin[axis]][axis].include(r.box);
      ++bins.count[bin[axis]][axis];
    }
  }
  return bins;
}

Split best_split(const Bins& bins) {
  constexpr Floats never{math::float_infinity, math::float_infinity, math::float_infinity, math::float_infinity};
  Box side[3];
  Integers entries{};
  const auto cost_with = [&](std::size_t bin) {
    for (std::size_t axis = 0; axis < 3; ++axis) side[axis].include(bins.box[bin][axis]);
    entries += bins.count[bin];
    const Floats cost = half_areas(side) * __builtin_convertvector(entries, Floats);
    return entries == 0 ? never : cost;
  };
  Floats cost_left[bin_count];
  for (std::size_t i = 0; i + 1 < bin_count; ++i) cost_left[i + 1] = cost_with(i);
  std::fill_n(side, 3, Box{});
  entries = Integers{};
  Floats least = never;
  Integers bin_of_least{};
  for (std::size_t i = bin_count - 1; i >= 1; --i) {
    const Floats cost = cost_left[i] + cost_with(i);
    const auto k = static_cast<std::int32_t>(i);
    bin_of_least = cost < least ? Integers{k, k, k, k} : bin_of_least;
    least = min(cost, least);
  }
  Split best;
  for (int axis = 0; axis < 3; ++axis) {
    if (least[axis] < best.cost) best = {axis, bin_of_least[axis], least[axis]};
  }
  return best;
}

std::size_t partition(std::span<const Reference> range, const Binning& binning, const Bins& bins, const Split& split,
                      Reference* to) {
  std::size_t left_count = 0;
  for (int bin = 0; bin < split.bin; ++bin) left_count += static_cast<std::size_t>(bins.count[bin][split.axis]);
  const float lower = binning.lower[split.axis], scale = binning.scale[split.axis],
              middle = static_cast<float>(split.bin);
  std::size_t left = 0, right = left_count;
  for (const Reference& r : range) {
    // As a mask, since a branch on it would be as good as random.
    const std::size_t is_left = (r.doubled_center(split.axis) - lower) * scale < middle ? ~std::size_t{0} : 0;
    Box& box = to[right ^ ((right ^ left) & is_left)].box;
    box.lower = r.box.lower, box.minus_upper = r.box.minus_upper;
    left -= is_left, right += 1 + is_left;
  }
  return left_count;
}

}  // namespace penumbra::accel
