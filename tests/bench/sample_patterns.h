#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace penumbra::bench {

/// A small generator of its own, so that nothing here shares numbers with the renderer: PCG-RXS-M-XS-32 over a hashed
/// start. O'Neill, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms", 2014.
class Random {
 public:
  explicit Random(std::uint64_t place) {
    place = (place ^ (place >> 30)) * 0xbf58476d1ce4e5b9u;
    place = (place ^ (place >> 27)) * 0x94d049bb133111ebu;
    state_ = static_cast<std::uint32_t>(place ^ (place >> 31) ^ (place >> 32));
  }
  std::uint32_t bits() {
    state_ = state_ * 747796405u + 2891336453u;
    const std::uint32_t word = ((state_ >> ((state_ >> 28) + 4)) ^ state_) * 277803737u;
    return (word >> 22) ^ word;
  }
  /// In [0, 1).
  float uniform() { return static_cast<float>(bits() >> 8) * 0x1p-24f; }

 private:
  std::uint32_t state_;
};

struct SamplePoint {
  float x, y;
};

/// Shirley and Chiu's concentric map from the unit square to the unit disc.
inline SamplePoint concentric(float u, float v) {
  constexpr float quarter_pi = 0.785398163f;
  const float a = 2 * u - 1, b = 2 * v - 1;
  const bool is_steep = std::fabs(a) > std::fabs(b);
  const float radius = is_steep ? a : b;
  const float quotient = radius == 0 ? 0 : (is_steep ? b : a) / radius;
  const float angle = quarter_pi * quotient;
  const float c = radius * std::cos(angle), s = radius * std::sin(angle);
  return is_steep ? SamplePoint{c, s} : SamplePoint{s, c};
}

/// Ready-made sets of points on the unit disc or square. A (hit, light) takes one and turns or shifts it, which costs
/// nothing beside its rays.
class PointPatterns {
 public:
  static constexpr std::uint32_t count = 64;

  /// `next(set, i)` is point i of a set.
  template <class Next>
  PointPatterns(int samples, const Next& next) : samples_(samples) {
    for (std::uint32_t set = 0; set < count; ++set) {
      for (int i = 0; i < samples; ++i) {
        const SamplePoint point = next(set, i);
        x_.push_back(point.x), y_.push_back(point.y);
      }
    }
  }
  int samples() const { return samples_; }
  const float* x(std::uint32_t set) const { return &x_[set * static_cast<std::size_t>(samples_)]; }
  const float* y(std::uint32_t set) const { return &y_[set * static_cast<std::size_t>(samples_)]; }

 private:
  int samples_;
  std::vector<float> x_, y_;
};

}  // namespace penumbra::bench
