#pragma once
#include "engine/math/constants.h"

/// Transcendental functions in plain rounded arithmetic: unlike those of libm, whose variants differ by processor,
/// they give the same bits on every machine. Errors are in units of the last place, as tests/engine measures them.
namespace penumbra::math {

struct SineCosine {
  double sine, cosine;
};

/// Of an angle in turns (1 = full circle), |turns| < 2³⁰, within 2 units. Exact at multiples of a quarter.
SineCosine sine_cosine_turns(double turns);
inline SineCosine sine_cosine_degrees(double degrees) { return sine_cosine_turns(degrees / 360); }

/// base^exponent for 0 ≤ base and 0 ≤ exponent < 2³⁰; 0⁰ = 1. Within 2 units for results in [1e-5, 1], within 32 for
/// others; whole exponents up to 4096 are multiplied out, within as many units as the exponent says.
double power(double base, double exponent);

/// 2^exponent for |exponent| ≤ 1000, within 2 units; exact for whole exponents.
double power_of_two(double exponent);

/// The angle of (x, y) in radians, in [−π, π], within 2 units; 0 for (0, 0).
double arc_tangent(double y, double x);

}  // namespace penumbra::math
