#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "engine/math/affine.h"
#include "engine/math/elementary.h"
#include "engine/math/error_free.h"
#include "engine/math/vec3.h"

using namespace penumbra::math;

TEST_CASE("own sine, cosine, power and arc tangent agree with long double to 1e-14") {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform;
  constexpr long double tau = 6.283185307179586476925286766559L;
  long double sine_error = 0, power_error = 0, angle_error = 0;
  for (int i = 0; i < 200'000; ++i) {
    const double turns = 4 * uniform(random) - 2;
    const auto [sine, cosine] = sine_cosine_turns(turns);
    sine_error = std::max<long double>(sine_error, std::fabs(sine - std::sin(tau * turns)));
    sine_error = std::max<long double>(sine_error, std::fabs(cosine - std::cos(tau * turns)));
    const double base = uniform(random), exponent = 300 * uniform(random) * (i % 2 == 0 ? 1 : 0.01);
    const long double exact = std::pow(static_cast<long double>(base), static_cast<long double>(exponent));
    // Where the result can still be seen; the error grows with the exponent of the result.
    if (exact > 1e-6L) power_error = std::max<long double>(power_error, std::fabs(power(base, exponent) / exact - 1));
    const double x = 2 * uniform(random) - 1, y = 2 * uniform(random) - 1;
    angle_error =
        std::max<long double>(angle_error, std::fabs(arc_tangent(y, x) - std::atan2(static_cast<long double>(y), x)));
  }
  CHECK(sine_error < 1e-14);
  CHECK(power_error < 1e-14);
  CHECK(angle_error < 1e-14);
}

TEST_CASE("quarters of a turn are exact, and so are the powers 0 and 1") {
  CHECK(sine_cosine_degrees(90).cosine == 0);
  CHECK(sine_cosine_degrees(180).sine == 0);
  CHECK(sine_cosine_degrees(180).cosine == -1);
  CHECK(power(0, 0) == 1);
  CHECK(power(0, 3) == 0);
  CHECK(power(0.3, 1) == 0.3);
  CHECK(power(0.5, 10) == 0x1p-10);
  CHECK(power(1e-300, 1e6) == 0);
}

TEST_CASE("a difference of products has the sign of the exact one") {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(1, 2);
  for (int i = 0; i < 100'000; ++i) {
    const double a = uniform(random), b = uniform(random), c = uniform(random);
    // d so that a·b and c·d differ by rounding only.
    const double d = a * b / c;
    const __float128 exact = static_cast<__float128>(a) * b - static_cast<__float128>(c) * d;
    const double found = signed_difference_of_products(a, b, c, d);
    CHECK((exact > 0) == (found > 0));
    CHECK((exact < 0) == (found < 0));
    CHECK((signed_difference_of_products(c, d, a, b) < 0) == (found > 0));
  }
}

TEST_CASE("lengths neither overflow nor vanish") {
  CHECK(length({3e200, 4e200, 0}) == doctest::Approx(5e200));
  CHECK(length({3e-200, 4e-200, 0}) == doctest::Approx(5e-200));
  CHECK(length(normalize({1e-300, 2e-300, 2e-300})) == doctest::Approx(1));
  CHECK(length(normalize({1e300, 1e300, 1e300})) == doctest::Approx(1));
}

TEST_CASE("an affine map and its inverse undo each other; frames are orthonormal") {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-2, 2);
  const auto vector = [&] { return Vec3{uniform(random), uniform(random), uniform(random)}; };
  for (int i = 0; i < 1000; ++i) {
    const Affine map{{vector(), vector(), vector()}, vector()};
    if (std::fabs(map.determinant()) < 0.1) continue;
    const Vec3 p = vector();
    CHECK(length(inverse(map).point(map.point(p)) - p) < 1e-12);
    CHECK(length((inverse(map) * map).point(p) - p) < 1e-12);
    const Frame frame = frame_around(normalize(p));
    CHECK(std::fabs(dot(frame.u, frame.v)) < 1e-15);
    CHECK(length(cross(frame.u, frame.v) - frame.n) < 1e-15);
  }
}
