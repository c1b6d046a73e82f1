#include "engine/sampling/patterns.h"

#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"

namespace penumbra::sampling {
namespace {

std::uint32_t reverse_bits(std::uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
  return (x >> 16) | (x << 16);
}

/// Each bit is flipped by a hash of the bits below it (constants of Vegdahl's improvement of Laine and Karras).
std::uint32_t scramble_reversed(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

std::uint32_t owen(std::uint32_t x, std::uint32_t seed) {
  return reverse_bits(scramble_reversed(reverse_bits(x), seed));
}

/// Second dimension of Sobol': the Pascal matrix modulo 2, already bit-reversed.
std::uint32_t sobol_second(std::uint32_t index) {
  std::uint32_t result = 0;
  for (std::uint32_t column = 0x80000000u; index != 0; index >>= 1, column ^= column >> 1) {
    if ((index & 1u) != 0) result ^= column;
  }
  return result;
}

}  // namespace

Point2 sobol_owen(std::uint32_t index, const Key& key) {
  const std::uint32_t shuffled = owen(index, key.bits32(0));
  const std::uint32_t x = owen(reverse_bits(shuffled), key.bits32(1)), y = owen(sobol_second(shuffled), key.bits32(2));
  return {x * 0x1p-32, y * 0x1p-32};
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
