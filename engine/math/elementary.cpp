#include "engine/math/elementary.h"

#include <algorithm>
#include <cmath>

#include "engine/math/constants.h"

namespace penumbra::math {
namespace {

/// A number as the sum of a double and a small rest.
struct Pair {
  double high, low;
};

/// Of π, by halves and quarters; what is left beyond the double.
constexpr double pi_rest = 1.2246467991473532e-16;

/// log₂ m for m in [√½, √2]: 2·artanh(s)/ln 2 with s = (m − 1)/(m + 1).
Pair log2_near_one(double m) {
  const double over = m + 1, over_rest = m - (over - 1);
  const double s = (m - 1) / over, s_rest = (std::fma(-s, over, m - 1) - s * over_rest) / over;
  const double q = s * s;
  double sum = 0;
  for (int k = 25; k >= 3; k -= 2) sum = (sum + 1.0 / k) * q;
  constexpr double two_log2_e = 2.8853900817779268, two_log2_e_rest = 4.0710547481862066e-17;
  const double high = s * two_log2_e;
  const double rest = std::fma(s, two_log2_e, -high) + s * two_log2_e_rest + (s_rest + s * sum) * two_log2_e;
  const double nearest = high + rest;
  return {nearest, rest - (nearest - high)};
}

/// e^x for |x| ≤ ½·ln 2, Taylor.
double exp_near_zero(double x) {
  double sum = 0;
  for (int k = 15; k >= 2; --k) sum = (sum + 1) * x / k;
  return 1 + (x + x * sum);
}

/// arctan of |x| ≤ tan(π/8), Taylor.
double arc_tangent_small(double x) {
  const double q = x * x;
  double sum = 0;
  for (int k = 41; k >= 3; k -= 2) sum = (((k & 2) != 0 ? -1.0 : 1.0) / k + sum) * q;
  return x + x * sum;
}

}  // namespace

SineCosine sine_cosine_turns(double turns) {
  const double quarter = std::nearbyint(4 * turns);
  const double rest = turns - quarter / 4, x = rest * (2 * pi), q = x * x;
  const double x_rest = std::fma(rest, 2 * pi, -x) + rest * (2 * pi_rest);
  // Dividing would take longer than all the rest.
  static constexpr auto per = [](int a, int b) { return -1.0 / (a * b); };
  static constexpr double of_sine[]{per(2, 3),   per(4, 5),   per(6, 7),   per(8, 9),  per(10, 11),
                                    per(12, 13), per(14, 15), per(16, 17), per(18, 19)};
  static constexpr double of_cosine[]{per(1, 2),   per(3, 4),   per(5, 6),   per(7, 8),  per(9, 10),
                                      per(11, 12), per(13, 14), per(15, 16), per(17, 18)};
  double sine = 0, cosine = 0;
  for (int i = 8; i >= 0; --i) {
    sine = (1 + sine) * (q * of_sine[i]);
    cosine = (1 + cosine) * (q * of_cosine[i]);
  }
  sine = x + (x * sine + x_rest);
  cosine = 1 + (cosine - x * x_rest);
  switch (static_cast<long long>(quarter) & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

double power(double base, double exponent) {
  if (exponent == 0) return 1;
  if (base == 0) return 0;
  if (exponent <= 4096 && exponent == std::floor(exponent)) {
    double result = 1, square = base;
    for (int rest = static_cast<int>(exponent);; square *= square) {
      if ((rest & 1) != 0) result *= square;
      rest >>= 1;
      if (rest == 0) return result;
    }
  }
  int binary_exponent = 0;
  double mantissa = std::frexp(base, &binary_exponent);
  if (mantissa < 0.70710678118654752440) mantissa *= 2, --binary_exponent;
  // The exponent of the result to nearly twice double precision: its fraction decides the digits.
  const Pair fraction = log2_near_one(mantissa);
  const double log2_base = binary_exponent + fraction.high;
  const double log2_rest =
      binary_exponent == 0 ? fraction.low : fraction.high - (log2_base - binary_exponent) + fraction.low;
  const double log2_power = exponent * log2_base;
  if (log2_power < -1080) return 0;
  if (log2_power > 1030) return math::infinity;
  const double power_rest = std::fma(exponent, log2_base, -log2_power) + exponent * log2_rest;
  const double whole = std::nearbyint(log2_power);
  constexpr double ln_2 = 0.69314718055994530942;
  return std::ldexp(exp_near_zero(((log2_power - whole) + power_rest) * ln_2), static_cast<int>(whole));
}

double power_of_two(double exponent) {
  constexpr double ln_2 = 0.69314718055994530942;
  const double whole = std::nearbyint(exponent);
  return std::ldexp(exp_near_zero((exponent - whole) * ln_2), static_cast<int>(whole));
}

double arc_tangent(double y, double x) {
  const double ax = std::fabs(x), ay = std::fabs(y);
  if (ax == 0 && ay == 0) return 0;
  constexpr double tan_eighth = 0.41421356237309504880;
  const double small = std::min(ax, ay), large = std::max(ax, ay), ratio = small / large;
  // The angle is offset + rest, where the offset is a multiple of a quarter of π.
  double quarters = 0, rest = 0;
  if (ratio <= tan_eighth) {
    rest = arc_tangent_small(ratio);
  } else {
    quarters = 1, rest = arc_tangent_small((small - large) / (small + large));
  }
  if (ay > ax) quarters = 2 - quarters, rest = -rest;
  if (std::signbit(x)) quarters = 4 - quarters, rest = -rest;
  return std::copysign(quarters * (pi / 4) + (rest + quarters * (pi_rest / 4)), y);
}

}  // namespace penumbra::math
