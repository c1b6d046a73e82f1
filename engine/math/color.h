#pragma once
#include <algorithm>

namespace penumbra::math {

/// Linear-light RGB; 1 is display white. Products and sums are per channel.
struct Color {
  double r = 0, g = 0, b = 0;
  bool operator==(const Color&) const = default;
};

inline constexpr Color black{0, 0, 0};
inline constexpr Color white{1, 1, 1};

inline Color grey(double value) { return {value, value, value}; }
inline Color operator+(const Color& a, const Color& b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
inline Color operator-(const Color& a, const Color& b) { return {a.r - b.r, a.g - b.g, a.b - b.b}; }
inline Color operator*(const Color& a, const Color& b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }
inline Color operator*(const Color& a, double s) { return {a.r * s, a.g * s, a.b * s}; }
inline Color& operator+=(Color& a, const Color& b) { return a = a + b; }
inline double max_channel(const Color& a) { return std::max(a.r, std::max(a.g, a.b)); }
inline bool is_black(const Color& a) { return a.r == 0 && a.g == 0 && a.b == 0; }

}  // namespace penumbra::math
