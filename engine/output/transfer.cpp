#include "engine/output/transfer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "engine/math/constants.h"
#include "engine/math/elementary.h"

namespace penumbra::output {

double linear_from_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : math::power((encoded + 0.055) / 1.055, 2.4);
}

namespace {

constexpr double half = 0.5;  // truncating x + half rounds x ≥ 0 to nearest

double clamped(float value) { return value > 0 ? std::min(static_cast<double>(value), 1.0) : 0; }

/// The sRGB level of a linear value, by the values where levels change. Positive floats order like their bits, so
/// those are what is compared. A table over the leading bits – exponent and `mantissa_bits` – says at which level a
/// bucket of values starts. A bucket holds one change of 8-bit levels at most; 16-bit ones grow evenly in it, to within
/// one.
template <class Level, int mantissa_bits, int octaves>
class SrgbLevels {
 public:
  SrgbLevels() {
    for (std::uint32_t level = 0; level < top; ++level) {
      const double limit = linear_from_srgb((level + 0.5) / top);
      auto first = static_cast<float>(limit);
      if (first < limit) first = std::nextafter(first, 1.0F);
      upper_[level] = std::bit_cast<std::uint32_t>(first);
    }
    upper_[top] = std::bit_cast<std::uint32_t>(math::float_infinity);
    for (std::uint32_t bucket = 0, level = 0; bucket <= buckets; ++bucket) {
      while (upper_[level] <= first_bits + (bucket << shift)) ++level;
      start_[bucket] = static_cast<Level>(level);
    }
  }

  Level level(float value) const {
    // The first bucket lies below level 1 as a whole, and so does NaN, which fails the comparison.
    const std::uint32_t bits = value > first_value ? std::bit_cast<std::uint32_t>(std::min(value, 1.0F)) : first_bits;
    const std::uint32_t offset = bits - first_bits, bucket = offset >> shift;
    std::uint32_t guess = start_[bucket];
    if constexpr (has_steep_buckets) {
      const std::uint32_t rise = start_[std::min(bucket + 1, buckets)] - guess;
      guess += (rise * (offset & ((1U << shift) - 1))) >> shift;
      guess -= guess > 0 && bits < upper_[guess - 1] ? 1 : 0;
    }
    guess += bits >= upper_[guess] ? 1 : 0;
    return static_cast<Level>(guess);
  }

 private:
  static constexpr bool has_steep_buckets = sizeof(Level) > 1;
  static constexpr std::uint32_t top = std::numeric_limits<Level>::max(), shift = 23 - mantissa_bits;
  static constexpr std::uint32_t buckets = octaves << mantissa_bits;
  static constexpr std::uint32_t first_bits = std::bit_cast<std::uint32_t>(1.0F) - (buckets << shift);
  static constexpr float first_value = std::bit_cast<float>(first_bits);
  std::array<std::uint32_t, top + 1> upper_;  // by level, the bits of the least float above it
  std::array<Level, buckets + 1> start_;      // by bucket, the level of its first value
};

}  // namespace

std::vector<std::uint8_t> to_8_bit(const render::Film& film, scene::Transfer transfer) {
  std::vector<std::uint8_t> result(film.rgb.size());
  if (transfer == scene::Transfer::linear) {
    std::transform(film.rgb.begin(), film.rgb.end(), result.begin(),
                   [](float v) { return static_cast<std::uint8_t>(clamped(v) * 255 + half); });
  } else {
    static const SrgbLevels<std::uint8_t, 8, 13> levels;
    std::transform(film.rgb.begin(), film.rgb.end(), result.begin(), [](float v) { return levels.level(v); });
  }
  return result;
}

std::vector<std::uint16_t> to_16_bit(const render::Film& film, scene::Transfer transfer) {
  std::vector<std::uint16_t> result(film.rgb.size());
  if (transfer == scene::Transfer::linear) {
    std::transform(film.rgb.begin(), film.rgb.end(), result.begin(),
                   [](float v) { return static_cast<std::uint16_t>(clamped(v) * 65535 + half); });
  } else {
    static const SrgbLevels<std::uint16_t, 10, 21> levels;
    std::transform(film.rgb.begin(), film.rgb.end(), result.begin(), [](float v) { return levels.level(v); });
  }
  return result;
}

}  // namespace penumbra::output
