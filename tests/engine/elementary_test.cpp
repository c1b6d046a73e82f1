// The engine's own transcendental functions against long double, in units of the last place.
#include "engine/math/elementary.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace penumbra::math;

namespace {

/// How many units of its last place `found` is away from `exact`.
double ulps(double found, long double exact) {
  const double size = std::fabs(static_cast<double>(exact));
  const double unit = std::nextafter(size, penumbra::math::infinity) - size;
  return static_cast<double>(std::fabs(found - exact) / static_cast<long double>(unit));
}

constexpr long double tau = 6.283185307179586476925286766559L;

}  // namespace

TEST_CASE("sine and cosine of turns") {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  double worst = 0;
  for (int i = 0; i < 300'000; ++i) {
    // Of every size, and close to the quarters, where one of the two is small.
    const double turns = i % 3 == 0   ? uniform(random)
                         : i % 3 == 1 ? 0.25 * (i % 8) + std::ldexp(uniform(random), -(i % 40))
                                      : 1e6 * uniform(random);
    const long double rest = static_cast<long double>(turns) - std::nearbyint(turns);
    const long double nearest_quarter = std::nearbyint(4 * rest);
    const long double x = (rest - nearest_quarter / 4) * tau;
    const long double s[]{std::sin(x), std::cos(x), -std::sin(x), -std::cos(x)};
    const auto quarter = static_cast<unsigned>(static_cast<int>(nearest_quarter)) % 4;
    const auto [sine, cosine] = sine_cosine_turns(turns);
    worst = std::max({worst, ulps(sine, s[quarter]), ulps(cosine, s[(quarter + 1) % 4])});
  }
  MESSAGE("sine and cosine within ", worst, " ulp");
  CHECK(worst <= 2);
}

TEST_CASE("powers of two") {
  std::mt19937_64 random(13);
  std::uniform_real_distribution<double> uniform(-100, 100);
  double worst = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double exponent = uniform(random);
    worst = std::max(worst, ulps(power_of_two(exponent), std::exp2(static_cast<long double>(exponent))));
  }
  MESSAGE("powers of two within ", worst, " ulp");
  CHECK(worst <= 2);
  for (int whole = -100; whole <= 100; ++whole) CHECK(power_of_two(whole) == std::ldexp(1.0, whole));
}

TEST_CASE("arc tangent") {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> uniform(-1, 1);
  double worst = 0;
  for (int i = 0; i < 300'000; ++i) {
    const double x = uniform(random), y = std::ldexp(uniform(random), i % 80 - 40);
    worst =
        std::max(worst, ulps(arc_tangent(y, x), std::atan2(static_cast<long double>(y), static_cast<long double>(x))));
  }
  MESSAGE("arc tangent within ", worst, " ulp");
  CHECK(worst <= 2);
}

TEST_CASE("powers, whole and not") {
  std::mt19937_64 random(13);
  std::uniform_real_distribution<double> uniform(0, 1);
  double worst = 0, worst_display = 0, worst_whole = 0;
  for (int i = 0; i < 300'000; ++i) {
    const double base = i % 2 == 0 ? uniform(random) : std::ldexp(uniform(random), i % 60 - 30);
    const double exponent = std::ldexp(uniform(random), i % 12);
    const long double exact = std::pow(static_cast<long double>(base), static_cast<long double>(exponent));
    if (exact > 1e-300L && exact < 1e300L) worst = std::max(worst, ulps(power(base, exponent), exact));
    // The sRGB curve and highlights as bright as can be told from black.
    if (exact > 1e-5L && exact < 1) worst_display = std::max(worst_display, ulps(power(base, exponent), exact));
    const double whole = 1 + i % 256;
    const long double exact_whole = std::pow(static_cast<long double>(base), static_cast<long double>(whole));
    if (exact_whole > 1e-300L && exact_whole < 1e300L)
      worst_whole = std::max(worst_whole, ulps(power(base, whole), exact_whole) / whole);
  }
  MESSAGE("powers within ", worst, " ulp, within ", worst_display, " for results in [1e-5, 1], whole ones within ",
          worst_whole, " ulp times the exponent");
  CHECK(worst <= 32);
  CHECK(worst_display <= 2);
  CHECK(worst_whole <= 1);
}
