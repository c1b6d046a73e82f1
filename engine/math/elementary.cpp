#include "engine/math/elementary.h"

#include <cmath>

namespace penumbra::math {
namespace {

/// ln m for m in [√½, √2]: 2·artanh((m − 1)/(m + 1)).
double log_near_one(double m) {
  const double s = (m - 1) / (m + 1), q = s * s;
  double sum = 0;
  for (int k = 23; k >= 3; k -= 2) sum = (sum + 1.0 / k) * q;
  return 2 * s * (1 + sum);
}

/// e^x for |x| ≤ ½·ln 2, Taylor.
double exp_near_zero(double x) {
  double sum = 1;
  for (int k = 14; k >= 1; --k) sum = 1 + sum * x / k;
  return sum;
}

/// arctan of |x| ≤ tan(π/8), Taylor.
double arc_tangent_small(double x) {
  const double q = x * x;
  double sum = 0;
  for (int k = 41; k >= 3; k -= 2) sum = (((k & 2) != 0 ? -1.0 : 1.0) / k + sum) * q;
  return x * (1 + sum);
}

}  // namespace

SineCosine sine_cosine_turns(double turns) {
  const double quarter = std::nearbyint(4 * turns);
  const double x = (turns - quarter / 4) * (2 * pi), q = x * x;
  double sine = 0, cosine = 0;
  for (int k = 18; k >= 2; k -= 2) {
    sine = (1 + sine) * -q / (k * (k + 1));
    cosine = (1 + cosine) * -q / (k * (k - 1));
  }
  sine = x * (1 + sine);
  cosine = 1 + cosine;
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
  constexpr double log2_e = 1.44269504088896340736;
  const double log2_power = exponent * (binary_exponent + log_near_one(mantissa) * log2_e);
  if (log2_power < -1080) return 0;
  if (log2_power > 1030) return HUGE_VAL;
  const double whole = std::nearbyint(log2_power);
  return std::ldexp(exp_near_zero((log2_power - whole) / log2_e), static_cast<int>(whole));
}

double arc_tangent(double y, double x) {
  const double ax = std::fabs(x), ay = std::fabs(y);
  if (ax == 0 && ay == 0) return 0;
  constexpr double tan_eighth = 0.41421356237309504880;
  const bool steep = ay > ax;
  const double ratio = steep ? ax / ay : ay / ax;
  double angle = ratio <= tan_eighth ? arc_tangent_small(ratio) : pi / 4 + arc_tangent_small((ratio - 1) / (ratio + 1));
  if (steep) angle = pi / 2 - angle;
  if (std::signbit(x)) angle = pi - angle;
  return std::copysign(angle, y);
}

}  // namespace penumbra::math
