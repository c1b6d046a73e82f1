#pragma once
#include <algorithm>
#include <cmath>

#include "engine/math/color.h"
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
};

/// The error of a covered share s from N well-spread samples: its variance is about c·s(1 − s)·N^−1.5, with c measured
/// on half-planes across a disc.
inline constexpr double spread_variance = 0.62;
/// The same c for M chords, whose variance is about c·s(1 − s)·M^−3.
inline constexpr double chord_variance = 0.46;

/// The samples every disc light gets at a hit. Where its occluders are few and simple, chords that are as good as the
/// points of the spiral: √N of them. Two at least and an even number of
/// chords, so that halves tell the error.
struct DiscSampling {
  explicit DiscSampling(int samples)
      : spiral(std::max(2, samples)), chords(2 * std::max(1, static_cast<int>(std::ceil(0.5 * std::sqrt(samples))))) {}
  sampling::DiscSpiral spiral;
  sampling::DiscChords chords;
};

/// Somebody who cancels waits for so many samples of one light at most.
inline constexpr std::uint32_t samples_between_looks = 64;

}  // namespace penumbra::shading
