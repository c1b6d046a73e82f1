#pragma once
#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/math/color.h"
#include "engine/sampling/halves.h"
#include "engine/sampling/patterns.h"

namespace penumbra::shading {

using math::Color;

/// The variance of a mean, per channel, found in two ways. `measured` (see sampling::Halves) is right on average over
/// many means but may be small by chance; `modelled` is the typical variance of a mean like this: to stop at, no single
/// one should be trusted further.
struct Variance {
  Color measured, modelled;
};

/// The mean transmittance over a light and the variance of that estimate.
struct Visibility {
  Color mean = math::white;
  Variance variance;
  bool is_certain = false;  // exact: without variance
  Color missed = {};        // of the variance: of others like it, who agree by chance
};

/// The error of a covered share s from N well-spread samples: its variance is about c·s(1 − s)·N^−1.5, with c measured
/// on half-planes across a disc.
inline constexpr double spread_variance = 0.62;
/// The same c for M chords, whose variance is about c·s(1 − s)·M^−3.
inline constexpr double chord_variance = 0.46;

/// A mean whose variance is modelled as `constant`·s(1 − s) / `count_to_the_power`, where s is the share that gets
/// through. That `count` samples agree does not mean that all would: s is as far from 0 and 1 as half a sample more
/// would put it.
inline Visibility estimated(const sampling::Halves& halves, sampling::Halves::Order order, double constant,
                            double count, double count_to_the_power) {
  const Color mean = halves.mean();
  const double least = 0.5 / (count + 1);
  const auto variance = [&](double share) {
    const double s = std::clamp(share, least, 1 - least);
    return constant * s * (1 - s) / count_to_the_power;
  };
  return {mean, {halves.variance(order), {variance(mean.r), variance(mean.g), variance(mean.b)}}, false};
}

/// The samples every disc light gets at a hit. Where its occluders are few and simple, chords that are as good as the
/// points of the spiral: √N of them. Two at least and an even number of
/// chords, so that halves tell the error.
struct DiscSampling {
  explicit DiscSampling(int samples)
      : spiral(std::max(2, samples)), chords(2 * std::max(1, static_cast<int>(std::ceil(0.5 * std::sqrt(samples))))) {
    if (spiral.count() <= most_few) few.emplace(spiral.count());
  }
  sampling::DiscSpiral spiral;
  sampling::DiscChords chords;
  /// So few that rays may cost less than to look for what hides the light: for points side by side.
  std::optional<sampling::DiscSpirals> few;
  static constexpr int most_few = 16;
  /// What a point sees may lean on what those beside it see: some that agree speak for the rest, and all tell of each.
  /// That leaves out what is hardly seen, and makes camera rays of one pixel look more alike than they are: not where
  /// a pixel has many.
  bool may_lean = true;
};

/// Somebody who cancels waits for so many samples of one light at most.
inline constexpr std::uint32_t samples_between_looks = 64;

}  // namespace penumbra::shading
