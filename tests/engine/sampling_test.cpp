#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <set>

#include "engine/math/elementary.h"
#include "engine/sampling/directions.h"
#include "engine/sampling/patterns.h"
#include "engine/shading/irradiance.h"

using namespace penumbra::sampling;
using penumbra::math::dot;
using penumbra::math::Vec3;
using penumbra::shading::projected_solid_angle;

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

TEST_CASE("a pixel's camera samples have one in every interval of each dimension, those of the lights included") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const CameraPattern pattern{Key(seed)};
    for (const std::uint32_t count : {4u, 64u, 256u}) {
      std::array<std::set<int>, 6> cells;
      std::set<std::pair<int, int>> pixel_cells;
      for (std::uint32_t i = 0; i < count; ++i) {
        const auto [place, lens] = pattern.sample(i);
        const Key light = Key(seed).of_sample(i).at(17);
        const std::array<double, 6> numbers{place.x, place.y, lens.x, lens.y, light.uniform(0), light.uniform(1)};
        for (std::size_t k = 0; k < 6; ++k) cells[k].insert(static_cast<int>(numbers[k] * count));
        pixel_cells.emplace(static_cast<int>(place.x * 2), static_cast<int>(place.y * count / 2));
      }
      for (const std::set<int>& each : cells) CHECK(each.size() == count);
      CHECK(pixel_cells.size() == count);
    }
  }
}

TEST_CASE("across an edge in pixel and lens camera samples beat independent ones the more, the more there are") {
  // Patterns of their own for pixel and lens leave 0.4 of the variance, however many there are.
  for (const auto& [count, most] : {std::pair{64u, 0.32}, {256u, 0.25}, {1024u, 0.18}}) {
    constexpr int edges = 400;
    double squares = 0, independent = 0;
    for (int edge = 0; edge < edges; ++edge) {
      const Key random = Key(5).at(static_cast<std::uint64_t>(edge));
      const auto [sine, cosine] = penumbra::math::sine_cosine_turns(random.at(1).uniform(0));
      const auto [lens_sine, lens_cosine] = penumbra::math::sine_cosine_turns(random.at(2).uniform(0));
      const double limit = random.at(3).uniform(0) - 0.5;
      std::array<double, 2> covered{};
      for (std::uint64_t half = 0; half < 2; ++half) {
        const CameraPattern pattern(random.at(10 + half));
        for (std::uint32_t i = 0; i < count; ++i) {
          const auto [place, lens] = pattern.sample(i);
          const Point2 disc = square_to_disc(lens);
          const double side =
              cosine * (place.x - 0.5) + sine * (place.y - 0.5) + lens_cosine * disc.x + lens_sine * disc.y;
          covered[half] += side < limit ? 1.0 / count : 0;
        }
      }
      const double share = (covered[0] + covered[1]) / 2, apart = covered[0] - covered[1];
      squares += apart * apart / 2, independent += share * (1 - share) / count;
    }
    CHECK(squares < most * independent);
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
  CHECK(chi_square([](const Key& key) {
          return static_cast<int>(key.uniform(0) * 8) * 8 + static_cast<int>(key.uniform(1) * 8);
        }) < limit);
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

namespace {

using Wide = long double;

Wide triple(const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto minor = [](Wide p, Wide q, Wide r, Wide s) { return p * s - q * r; };
  return a.x * minor(b.y, b.z, c.y, c.z) - a.y * minor(b.x, b.z, c.x, c.z) + a.z * minor(b.x, b.y, c.x, c.y);
}
Wide wide_dot(const Vec3& a, const Vec3& b) { return Wide(a.x) * b.x + Wide(a.y) * b.y + Wide(a.z) * b.z; }
Wide wide_length(const Vec3& a) { return std::sqrt(wide_dot(a, a)); }

/// Of a triangle seen from the origin. Van Oosterom, Strackee, "The Solid Angle of a Plane Triangle", 1983.
Wide solid_angle_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Wide la = wide_length(a), lb = wide_length(b), lc = wide_length(c);
  return 2 * std::atan2(std::fabs(triple(a, b, c)),
                        la * lb * lc + wide_dot(a, b) * lc + wide_dot(b, c) * la + wide_dot(c, a) * lb);
}

struct Panel {
  Vec3 corner, u, v, normal;
  double solid_angle() const {
    return static_cast<double>(solid_angle_of(corner, corner + u, corner + u + v) +
                               solid_angle_of(corner, corner + u + v, corner + v));
  }
};

/// Edges of 10^±6 times the distance, long and short, skewed, seen from above, from the side and edge-on.
Panel random_panel(std::uint64_t seed) {
  std::uint64_t drawn = 0;
  const auto uniform = [&] { return Key(seed).at(drawn++).uniform(0); };
  const auto scale = [&](double least, double most) { return std::pow(10, least + (most - least) * uniform()); };
  const auto turned = [&](double length) {
    const double angle = 2 * penumbra::math::pi * uniform();
    return Vec3{length * std::cos(angle), length * std::sin(angle), 0};
  };
  Panel panel;
  panel.u = turned(scale(-3, 6)), panel.v = turned(scale(-3, 6));
  if (uniform() < 0.5) panel.v = Vec3{-panel.u.y, panel.u.x, 0} * (length(panel.v) / length(panel.u));
  const Vec3 inside = panel.u * (2 * uniform() - 0.5) + panel.v * (2 * uniform() - 0.5);
  panel.corner = turned(uniform() < 0.5 ? 1 : 0) - inside;
  panel.corner.z = scale(-4, 0);
  // Somewhere in space, not along its axes.
  const penumbra::math::Frame frame = penumbra::math::frame_around(penumbra::math::normalize({0.3, -0.5, 0.8}));
  for (Vec3* x : {&panel.corner, &panel.u, &panel.v}) *x = frame.u * x->x + frame.v * x->y + frame.n * x->z;
  panel.normal = -frame.n;
  return panel;
}

}  // namespace

TEST_CASE("whatever a panel's size, shape and place: samples mean what is seen of it, and none stands for far more") {
  constexpr std::uint32_t keys = 64, count = 64;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    const Panel panel = random_panel(seed);
    const Key key(seed + 1'000'000);
    // All of it, a part of it, and what it sends to a surface that may be smooth and whose horizon may cut it.
    const Panel part{panel.corner, panel.u * key.at(0).uniform(0), panel.v * key.at(1).uniform(0), panel.normal};
    const Vec3 facing = direction_on_sphere({key.at(2).uniform(0), key.at(3).uniform(0)});
    const Vec3 smooth = seed % 2 == 0 ? facing : direction_on_sphere({key.at(4).uniform(0), key.at(5).uniform(0)});
    const Vec3 &c = panel.corner, &u = panel.u, &v = panel.v;
    const std::array expected{panel.solid_angle(), part.solid_angle(),
                              projected_solid_angle({c, c + u, c + u + v, c + v}, facing, smooth)};
    const SeenParallelogram seen(c, u, v, panel.normal);
    std::array<double, 3> sum{}, squares{};
    double largest = 0;
    for (std::uint32_t k = 0; k < keys; ++k) {
      std::array<double, 3> mean{};
      for (std::uint32_t i = 0; i < count; ++i) {
        const auto [place, solid_angle] = seen.sample(sobol_owen(i, key.at(k)));
        largest = std::max(largest, solid_angle);
        const Vec3 inside = place - c, across_u = cross(panel.normal, part.u), across_v = cross(panel.normal, part.v);
        const double a = dot(inside, across_v) / dot(part.u, across_v),
                     b = dot(inside, across_u) / dot(part.v, across_u);
        mean[0] += solid_angle / count;
        if (a < 1 && b < 1) mean[1] += solid_angle / count;
        if (dot(facing, place) > 0) mean[2] += solid_angle / count * std::fabs(dot(smooth, place)) / length(place);
      }
      for (std::size_t i = 0; i < 3; ++i) {
        const double off = mean[i] - expected[i];
        sum[i] += off / keys, squares[i] += off * off / keys;
      }
    }
    CHECK(largest <= 3 * expected[0]);
    // What one sample in some thousand meets, none may have met.
    const double unmet = 10.0 / (keys * count) * expected[0] + 1e-15;
    for (std::size_t i = 0; i < 3; ++i) {
      const double deviation = std::sqrt(std::max(0.0, squares[i] - sum[i] * sum[i]) / keys);
      INFO("panel ", seed, ", ", i, ": ", expected[i], ", mean off by ", sum[i], " ± ", deviation);
      CHECK(std::fabs(sum[i]) <= 6 * deviation + unmet);
    }
  }
}

TEST_CASE("directions to a sphere: on the light, and uniform in solid angle") {
  const Vec3 center{1, 2, 3};
  const auto cone = cone_of_sphere({0, 0, 0}, center, 1.5);
  REQUIRE(cone);
  const Vec3 axis = penumbra::math::normalize(center);
  // In a uniform cap the mean of cos θ is half way between 1 and the edge's.
  double mean = 0;
  constexpr std::uint32_t count = 4096;
  for (std::uint32_t i = 0; i < count; ++i) {
    const SeenPlace place = point_in_cone(*cone, sobol_owen(i, Key(1)));
    const Vec3 p = place.direction * place.distance;
    CHECK(std::fabs(length(p - center) - 1.5) < 1e-12);
    mean += dot(penumbra::math::normalize(p), axis) / count;
  }
  CHECK(mean == doctest::Approx(1 - cone->one_minus_cosine / 2).epsilon(1e-4));
}

TEST_CASE(
    "a sphere is sampled from far away and from just outside, and what a horizon leaves of it has a closed form") {
  constexpr std::uint32_t count = 1 << 14;
  for (const double distance : {1 + 0x1p-52, 1 + 1e-12, 1.001, 2.0, 100.0, 1e9}) {
    const Vec3 center = penumbra::math::normalize({1, 2, 3}) * distance;
    const auto cone = cone_of_sphere({0, 0, 0}, center, 1);
    REQUIRE(cone);
    for (const double share : {-0.999, -0.5, 0.0, 0.3, 0.999}) {  // of the radius: how high it hangs
      const Vec3 across = penumbra::math::frame_around(center * (1 / distance)).u;
      const double cosine = share / distance;
      const Vec3 n = center * (cosine / distance) + across * std::sqrt(1 - cosine * cosine);
      double sum = 0;
      for (std::uint32_t i = 0; i < count; ++i) {
        const auto [direction, far] = point_in_cone(*cone, sobol_owen(i, Key(4)));
        REQUIRE(std::fabs(length(direction) - 1) < 1e-12);
        REQUIRE(far > 0);
        REQUIRE(far <= std::sqrt((distance - 1) * (distance + 1)) * (1 + 1e-6));
        sum += std::max(0.0, dot(n, direction)) * cone->solid_angle / count;
      }
      INFO("distance ", distance, ", height ", share);
      if (distance < 1e4) {
        CHECK(std::fabs(penumbra::shading::projected_solid_angle_above(center, 1, n) - sum) <
              2e-4 * cone->solid_angle / distance);
      }
    }
  }
}

TEST_CASE("directions of the whole sphere have no mean") {
  constexpr std::uint32_t count = 4096;
  Vec3 sum;
  for (std::uint32_t i = 0; i < count; ++i) sum += direction_on_sphere(sobol_owen(i, Key(3))) * (1.0 / count);
  CHECK(length(sum) < 1e-3);
}
