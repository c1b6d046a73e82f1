#pragma once
#include <array>

#include "engine/math/color.h"

namespace penumbra::sampling {

using math::Color;

/// The mean of well-spread samples, from two halves that are well spread themselves. How far the halves are apart tells
/// how far the mean may be off, without a model of what is sampled – right on average over many means, while a single
/// one may look better or worse than it is.
class Halves {
 public:
  /// How the variance of a mean falls with the number of samples n: like n^-order.
  struct Order {
    /// Halves of order q have 2^q times the variance of the whole and lean to opposite sides; then
    /// variance of the whole = 1/(2^q − 1) · expected (half the difference)².
    double of_half_difference;
    /// 2^q.
    double gain() const { return 1 + 1 / of_half_difference; }
  };
  static constexpr Order of_gain(double gain) { return {1 / (gain - 1)}; }
  /// Samples that know nothing of each other.
  static constexpr Order independent{1.0};
  /// Points across an edge in d dimensions, q = 1 + 1/d: a pixel or a light, and a pixel and the lens.
  static constexpr Order points{1 / 1.8284271247461903}, points_through_lens{1 / 1.3784142300054421};
  /// Chords across an edge: 3 ≤ q ≤ 5, measured, and nearer to 3 the more chords or edges there are; two chords alone
  /// no better than q = 1.9.
  static constexpr Order chords(int count) { return {count > 8 ? 1 / 8.0 : count > 2 ? 1 / 10.0 : 0.37}; }

  /// Lines across a parallelogram: corners and slivers between lines, which more of them leave, count for more.
  static constexpr Order lines(int count) {
    return count > 8 ? Order{1 / 3.5} : count > 4 ? Order{1 / 6.0} : chords(count);
  }

  void add(bool is_second, const Color& value, double weight = 1) {
    sum_[is_second ? 1 : 0] += value * weight;
    weight_[is_second ? 1 : 0] += weight;
  }
  /// Of value − share · other, for values that were added in the same order.
  Halves minus(const Color& share, const Halves& other) const {
    Halves difference = *this;
    for (std::size_t i = 0; i < 2; ++i) difference.sum_[i] = sum_[i] - share * other.sum_[i];
    return difference;
  }
  Color mean() const { return (sum_[0] + sum_[1]) * (1 / (weight_[0] + weight_[1])); }
  /// Of `mean`, estimated. Both halves have samples.
  Color variance(Order order) const {
    const double whole = weight_[0] + weight_[1];
    const Color apart = sum_[0] * (1 / weight_[0]) - sum_[1] * (1 / weight_[1]);
    return apart * apart * (order.of_half_difference * (weight_[0] / whole) * (weight_[1] / whole));
  }

 private:
  std::array<Color, 2> sum_{};
  std::array<double, 2> weight_{};
};

}  // namespace penumbra::sampling
