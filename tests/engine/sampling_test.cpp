#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <set>

#include "engine/math/elementary.h"
#include "engine/sampling/directions.h"
#include "engine/sampling/patterns.h"

using namespace penumbra::sampling;
using penumbra::math::dot;
using penumbra::math::Vec3;

TEST_CASE("a scrambled Sobol' prefix of 2^k points has one point in every elementary interval") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Key key(seed);
    for (int x_bits = 0; x_bits <= 8; ++x_bits) {
      std::set<std::pair<int, int>> cells;
      for (std::uint32_t i = 0; i < 256; ++i) {
        const Point2 p = sobol_owen(i, key);
        REQUIRE(p.x >= 0);
        REQUIRE(p.x < 1);
        cells.emplace(static_cast<int>(p.x * (1 << x_bits)), static_cast<int>(p.y * (1 << (8 - x_bits))));
      }
      CHECK(cells.size() == 256);
    }
  }
}

TEST_CASE("single points are uniform over keys: a chi-square of 64 cells at 99.9 %") {
  const auto chi_square = [](const auto& cell_of) {
    constexpr int cells = 64, draws = 64'000;
    std::array<int, cells> counts{};
    for (std::uint64_t seed = 0; seed < draws; ++seed) ++counts[static_cast<std::size_t>(cell_of(Key(seed)))];
    double sum = 0;
    for (const int n : counts) sum += (n - draws / cells) * (n - draws / cells) / (1.0 * draws / cells);
    return sum;
  };
  constexpr double limit = 103.4;  // of 63 degrees of freedom
  CHECK(chi_square([](const Key& key) {
          const Point2 p = sobol_owen(5, key);
          return static_cast<int>(p.x * 8) * 8 + static_cast<int>(p.y * 8);
        }) < limit);
  const auto disc_cell = [](const Point2& p) {
    const double angle = std::atan2(p.y, p.x) / (2 * penumbra::math::pi) + 0.5;
    return std::min(7, static_cast<int>((p.x * p.x + p.y * p.y) * 8)) * 8 + std::min(7, static_cast<int>(angle * 8));
  };
  CHECK(chi_square([&](const Key& key) { return disc_cell(square_to_disc(sobol_owen(3, key))); }) < limit);
  const DiscSpiral one(1);
  CHECK(chi_square([&](const Key& key) { return disc_cell(one.point(0, DiscSpiral::turn(key))); }) < limit);
}

TEST_CASE("chords weigh 1 together and integrate the disc's second moment exactly") {
  for (const int count : {2, 3, 8, 33}) {
    const DiscChords chords(count);
    for (const double shift : {0.0, 0.3, 0.99}) {
      double weight = 0, moment = 0;
      for (int i = 0; i < count; ++i) {
        const auto chord = chords.chord(i, chords.shifted(shift));
        weight += chord.weight;
        moment += chord.weight * chord.offset * chord.offset;
      }
      CHECK(weight == doctest::Approx(1));
      if (count > 2) CHECK(moment == doctest::Approx(0.25));
    }
  }
}

TEST_CASE("directions to a sphere and a rectangle: on the light, and uniform in solid angle") {
  const Vec3 center{1, 2, 3};
  const auto cone = cone_of_sphere({0, 0, 0}, center, 1.5);
  REQUIRE(cone);
  const Vec3 axis = penumbra::math::normalize(center);
  // In a uniform cap the mean of cos θ is half way between 1 and the edge's.
  double mean = 0;
  constexpr std::uint32_t count = 4096;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 p = point_in_cone(*cone, sobol_owen(i, Key(1)));
    CHECK(std::fabs(length(p - center) - 1.5) < 1e-12);
    mean += dot(penumbra::math::normalize(p), axis) / count;
  }
  CHECK(mean == doctest::Approx(1 - cone->one_minus_cosine / 2).epsilon(1e-4));

  const Vec3 corner{-1, -0.5, 2}, u{2, 0, 0}, v{0, 3, 0};
  const auto rectangle = SphericalRectangle::seen_from({0, 0, 0}, corner, u, v);
  REQUIRE(rectangle);
  // The solid angle and the share of it at x < 0.3, by a fine sum over the area.
  double solid_angle = 0, left = 0;
  constexpr int steps = 1000;
  for (int i = 0; i < steps; ++i) {
    for (int k = 0; k < steps; ++k) {
      const Vec3 p = corner + u * ((i + 0.5) / steps) + v * ((k + 0.5) / steps);
      const double d = length(p), share = 6.0 / (steps * steps) * p.z / (d * d * d);
      solid_angle += share;
      if (p.x < 0.3) left += share;
    }
  }
  CHECK(rectangle->solid_angle() == doctest::Approx(solid_angle).epsilon(1e-5));
  int found = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3 p = rectangle->point(sobol_owen(i, Key(2)));
    CHECK(std::fabs(p.z - 2) < 1e-12);
    CHECK((p.x >= -1 && p.x <= 1 && p.y >= -0.5 && p.y <= 2.5));
    if (p.x < 0.3) ++found;
  }
  CHECK(found / 4096.0 == doctest::Approx(left / solid_angle).epsilon(3e-3));
  // The whole sphere: the mean direction is none.
  Vec3 sum;
  for (std::uint32_t i = 0; i < count; ++i) sum += direction_on_sphere(sobol_owen(i, Key(3))) * (1.0 / count);
  CHECK(length(sum) < 1e-3);
}
