#include "engine/output/transfer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/math/elementary.h"

namespace penumbra::output {
namespace {

/// IEC 61966-2-1, for linear values in [0, 1] and back.
double srgb_from_linear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * math::power(linear, 1 / 2.4) - 0.055;
}
double linear_from_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : math::power((encoded + 0.055) / 1.055, 2.4);
}

constexpr double half = 0.5;  // truncating x + half rounds x ≥ 0 to nearest

double clamped(float value) { return value > 0 ? std::min(static_cast<double>(value), 1.0) : 0; }

/// The sRGB level of a linear value, by comparing with the values where levels change.
class SrgbLevels {
 public:
  SrgbLevels() {
    for (std::size_t level = 0; level < 255; ++level)
      upper_[level] = linear_from_srgb((static_cast<double>(level) + 0.5) / 255);
    upper_[255] = HUGE_VAL;
    std::size_t level = 0;
    for (std::size_t step = 0; step < start_.size(); ++step) {
      while (upper_[level] <= static_cast<double>(step) / steps) ++level;
      start_[step] = static_cast<std::uint8_t>(level);
    }
  }
  std::uint8_t level(double linear) const {
    std::size_t level = start_[static_cast<std::size_t>(linear * steps)];
    while (upper_[level] <= linear) ++level;
    return static_cast<std::uint8_t>(level);
  }

 private:
  static constexpr int steps = 4096;  // finer than the levels where the curve is steepest
  std::array<double, 256> upper_;
  std::array<std::uint8_t, steps + 1> start_;
};

}  // namespace

std::vector<std::uint8_t> to_8_bit(const render::Film& film, scene::Transfer transfer) {
  std::vector<std::uint8_t> result(film.rgb.size());
  if (transfer == scene::Transfer::linear) {
    std::transform(film.rgb.begin(), film.rgb.end(), result.begin(),
                   [](float v) { return static_cast<std::uint8_t>(clamped(v) * 255 + half); });
  } else {
    static const SrgbLevels levels;
    std::transform(film.rgb.begin(), film.rgb.end(), result.begin(), [](float v) { return levels.level(clamped(v)); });
  }
  return result;
}

std::vector<std::uint16_t> to_16_bit(const render::Film& film, scene::Transfer transfer) {
  std::vector<std::uint16_t> result(film.rgb.size());
  std::transform(film.rgb.begin(), film.rgb.end(), result.begin(), [transfer](float v) {
    const double linear = clamped(v);
    const double encoded = transfer == scene::Transfer::linear ? linear : srgb_from_linear(linear);
    return static_cast<std::uint16_t>(std::min(encoded, 1.0) * 65535 + half);
  });
  return result;
}

}  // namespace penumbra::output
