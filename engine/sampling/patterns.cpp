#include "engine/sampling/patterns.h"

#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"

namespace penumbra::sampling {

Point2 sobol_owen(std::uint32_t index, const Key& key) {
  const std::uint32_t shuffled = owen(index, key.bits32(0));
  const std::uint32_t x = owen(reverse_bits(shuffled), key.bits32(1)), y = owen(sobol(shuffled, 1), key.bits32(2));
  return {x * 0x1p-32, y * 0x1p-32};
}

CameraPattern::CameraPattern(const Key& key) {
  for (std::size_t i = 0; i < seeds_.size(); ++i) seeds_[i] = key.bits32(static_cast<int>(i));
}

CameraPattern::Sample CameraPattern::sample(std::uint32_t index) const {
  const auto number = [&](std::size_t i) { return owen(sobol(index, i), seeds_[i]) * 0x1p-32; };
  return {{number(0), number(1)}, {number(2), number(3)}};
}

DiscSpiral::DiscSpiral(int count) : inverse_count_(1.0 / count) {
  static constexpr double golden_turn = 0.38196601125010515180;
  for (int i = 0; i < count; ++i) {
    const auto [sine, cosine] = math::sine_cosine_turns(i * golden_turn);
    cosine_.push_back(cosine), sine_.push_back(sine);
    around_.push_back(i);
  }
  const auto turns = [](int i) { return i * golden_turn - std::floor(i * golden_turn); };
  std::ranges::sort(around_, {}, turns);
}

DiscSpiral::Turn DiscSpiral::turn(const Key& key) {
  const auto [sine, cosine] = math::sine_cosine_turns(key.uniform(0));
  return {cosine, sine, key.uniform(1)};
}

Point2 DiscSpiral::point(int index, const Turn& turn) const {
  const auto i = static_cast<std::size_t>(index);
  const double radius = std::sqrt((index + turn.shift) * inverse_count_);
  return {radius * (cosine_[i] * turn.cosine - sine_[i] * turn.sine),
          radius * (cosine_[i] * turn.sine + sine_[i] * turn.cosine)};
}

DiscSpirals::DiscSpirals(int count) : count_(static_cast<std::size_t>(count)), inverse_count_(1.0 / count) {
  constexpr double turn_each_place = 0.41421356237309504880, turn_each_index = 0.38196601125010515180;
  for (std::size_t round = 0; round < count_; ++round) {
    for (std::size_t place = 0; place < places; ++place) {
      const auto [sine, cosine] = math::sine_cosine_turns(static_cast<double>(place) * turn_each_place +
                                                          static_cast<double>(index(round, place)) * turn_each_index);
      cosine_.push_back(cosine), sine_.push_back(sine);
    }
  }
}

void DiscSpirals::points(std::size_t round, const DiscSpiral::Turn& turn, Points& points) const {
  constexpr double shift_each_place = 0.61803398874989484820;
  const double *cosine = &cosine_[round * places], *sine = &sine_[round * places];
  for (std::size_t place = 0; place < places; ++place) {
    const double shift = turn.shift + static_cast<double>(place) * shift_each_place;
    const double part = shift - static_cast<double>(static_cast<int>(shift));
    const double radius = std::sqrt((static_cast<double>(index(round, place)) + part) * inverse_count_);
    points.x[place] = radius * (cosine[place] * turn.cosine - sine[place] * turn.sine);
    points.y[place] = radius * (cosine[place] * turn.sine + sine[place] * turn.cosine);
  }
}

DiscChords::DiscChords(int count) {
  for (int i = 0; i < count; ++i) {
    const auto [sine, cosine] = math::sine_cosine_turns(0.5 * i / count);
    cosine_.push_back(cosine), sine_.push_back(sine);
  }
}

DiscChords::Shift DiscChords::shifted(double shift) const {
  const auto [sine, cosine] = math::sine_cosine_turns(0.5 * shift / count());
  return {cosine, sine};
}

DiscChords::Chord DiscChords::chord(int index, const Shift& shift) const {
  const auto i = static_cast<std::size_t>(index);
  const double sine = sine_[i] * shift.cosine + cosine_[i] * shift.sine;
  return {cosine_[i] * shift.cosine - sine_[i] * shift.sine, sine, 2 * sine * sine / count()};
}

Point2 square_to_disc(const Point2& square) {
  const double x = 2 * square.x - 1, y = 2 * square.y - 1;
  if (x == 0 && y == 0) return {0, 0};
  const bool wide = std::fabs(x) > std::fabs(y);
  const double radius = wide ? x : y;
  const double turns = wide ? y / x / 8 : 0.25 - x / y / 8;
  const auto [sine, cosine] = math::sine_cosine_turns(turns);
  return {radius * cosine, radius * sine};
}

}  // namespace penumbra::sampling
