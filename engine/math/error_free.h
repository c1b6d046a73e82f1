#pragma once
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace penumbra::math {

/// Unit roundoff of double, 2⁻⁵³.
inline constexpr double unit_roundoff = std::numeric_limits<double>::epsilon() / 2;

/// γ(n) = n·u/(1 − n·u): bounds the relative error of n rounded operations in a row.
/// Higham, "Accuracy and Stability of Numerical Algorithms", 2nd ed., lemma 3.1.
constexpr double gamma(int n) { return n * unit_roundoff / (1 - n * unit_roundoff); }

/// a·b − c·d with a relative error of at most 1.5 units in the last place, so its sign is exact (barring underflow).
/// Kahan's algorithm; Jeannerod, Louvet, Muller, Math. Comp. 82, 2013.
inline double difference_of_products(double a, double b, double c, double d) {
  const double cd = c * d;
  return std::fma(a, b, -cd) + std::fma(-c, d, cd);
}

/// As difference_of_products, but only its sign is exact; plain arithmetic wherever that suffices.
inline double signed_difference_of_products(double a, double b, double c, double d) {
  const double ab = a * b, cd = c * d;
  const double difference = ab - cd;
  if (std::fabs(difference) > gamma(4) * (std::fabs(ab) + std::fabs(cd))) return difference;
  return difference_of_products(a, b, c, d);
}

/// The next number away from `x` towards +∞ (or −∞); `x` is finite.
inline double next_up(double x) {
  if (x == 0) return std::numeric_limits<double>::denorm_min();
  return std::bit_cast<double>(std::bit_cast<std::int64_t>(x) + (x > 0 ? 1 : -1));
}
inline double next_down(double x) { return -next_up(-x); }

}  // namespace penumbra::math
