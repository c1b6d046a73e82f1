#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "engine/sampling/hash.h"

namespace penumbra::sampling {

struct Point2 {
  double x, y;
};

/// Point `index` of a (0, 2)-sequence in [0, 1)², Owen-scrambled Sobol'. Every prefix is well spread; each point is
/// uniform over keys.
Point2 sobol_owen(std::uint32_t index, const Key& key);

/// Where the camera samples of a pixel look through: an Owen-scrambled Sobol' sequence over the pixel's square and the
/// lens, whose next two dimensions choose where the samples of each light lie (see Key::uniform). Well spread in all of
/// them together: each in a pattern of its own, the pairs would be as good as random, and the variance of the pixel's
/// mean would fall no faster than theirs.
class CameraPattern {
 public:
  explicit CameraPattern(const Key& key);
  struct Sample {
    Point2 place, lens;  // in [0, 1)²
  };
  Sample sample(std::uint32_t index) const;

 private:
  std::array<std::uint32_t, 4> seeds_;
};

/// `count` points in the unit disc, a rotated and shifted Vogel spiral: radius √((i + shift)/count), angle i golden
/// angles + rotation. Each point is uniform over keys; the error of a disc's covered share falls like count^−0.75.
class DiscSpiral {
 public:
  explicit DiscSpiral(int count);
  int count() const { return static_cast<int>(cosine_.size()); }
  /// Point `index` under the rotation and shift that `key` names.
  struct Turn {
    double cosine, sine, shift;
  };
  static Turn turn(const Key& key);
  Point2 point(int index, const Turn& turn) const;
  /// Every index once, in the order of the points around the middle.
  const std::vector<int>& around() const { return around_; }

 private:
  std::vector<double> cosine_, sine_;
  std::vector<int> around_;
  double inverse_count_;
};

/// `count` points in the unit disc for each of 16 places side by side: spirals whose shifts and turns are spread well,
/// so that the points of all places together make as good a pattern as those of each. Taken in rounds, a point of every
/// place each: the first so many places of any round are spread well, too.
class DiscSpirals {
 public:
  static constexpr std::size_t places = 16;
  explicit DiscSpirals(int count);
  std::size_t count() const { return count_; }
  /// Which of its points a place has in a round.
  std::size_t index(std::size_t round, std::size_t place) const { return (round + place) % count_; }
  /// The points of all places in a round, under a rotation and shift of all.
  struct Points {
    alignas(64) double x[places], y[places];
  };
  void points(std::size_t round, const DiscSpiral::Turn& turn, Points& points) const;

 private:
  std::size_t count_;
  double inverse_count_;
  std::vector<double> cosine_, sine_;  // a round after the other
};

/// `count` parallel chords of the unit disc, at offsets cos φ with φ = (i + shift)·π/count and weights in proportion to
/// sin² φ: the trapezoidal rule for ∫ over offsets, unbiased over shifts. The error of a covered share falls like
/// count^−1.5, and like count^−2 and faster where the chords cross the cover's edge.
class DiscChords {
 public:
  /// `count` ≥ 2.
  explicit DiscChords(int count);
  int count() const { return static_cast<int>(cosine_.size()); }
  struct Chord {
    double offset, half_length, weight;  // weights add up to 1
  };
  struct Shift {
    double cosine, sine;
  };
  /// `shift` in [0, 1).
  Shift shifted(double shift) const;
  Chord chord(int index, const Shift& shift) const;

 private:
  std::vector<double> cosine_, sine_;
};

/// A uniform point of the unit disc, from one of the unit square, keeping neighbours together. Shirley, Chiu, "A Low
/// Distortion Map Between Disk and Square", 1997.
Point2 square_to_disc(const Point2& square);

}  // namespace penumbra::sampling
