#include "engine/shading/shadows/chord_sweep.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "engine/math/elementary.h"

using namespace penumbra;
using math::Color;
using math::Vec3;
using shading::shadows::DiscCover;
using shading::shadows::DiscView;

namespace {

/// A unit disc light ten units above the origin.
DiscView unit_view() { return {{0, 0, 0}, {0, 0, 10}, {1, 0, 0}, {0, 1, 0}, false}; }

double mean(const std::vector<DiscCover>& covers, int chords, std::mt19937_64& random, int repeats) {
  const sampling::DiscChords pattern(chords);
  shading::shadows::ChordSweep sweep;
  std::uniform_real_distribution<double> uniform;
  double sum = 0;
  for (int i = 0; i < repeats; ++i) {
    sum += sweep.integrate(covers, {}, false, pattern, uniform(random), uniform(random), {}).mean().r;
  }
  return sum / repeats;
}

/// Whether a segment from the origin to (x, y, 10) crosses the triangle, in plain arithmetic.
bool crosses(const geometry::TriangleVertices& t, double x, double y) {
  const Vec3 d{x, y, 10}, e = t.v1 - t.v0, f = t.v2 - t.v0;
  const Vec3 p = math::cross(d, f);
  const double determinant = math::dot(e, p);
  const Vec3 s = Vec3{} - t.v0, q = math::cross(s, e);
  const double u = math::dot(s, p) / determinant, v = math::dot(d, q) / determinant, at = math::dot(f, q) / determinant;
  return u >= 0 && v >= 0 && u + v <= 1 && at > 0 && at < 1;
}

bool crosses(const geometry::SphereShape& sphere, double x, double y) {
  const Vec3 d = math::normalize(Vec3{x, y, 10});
  const double along = math::dot(sphere.center, d);
  const Vec3 across = sphere.center - d * along;
  return along > 0 && math::dot(across, across) < sphere.radius * sphere.radius;
}

bool crosses(const geometry::CylinderShape& cylinder, double x, double y) {
  return crossings(cylinder, {{0, 0, 0}, {x, y, 10}}, std::nullopt).count > 0;
}

/// What the shape hides of the unit view; it must be told in covers.
template <class Shape>
std::vector<DiscCover> covers_of(const Shape& shape) {
  std::vector<DiscCover> covers;
  REQUIRE(append_cover(shape, unit_view(), covers));
  return covers;
}

}  // namespace

TEST_CASE("half a disc: closed form F2") {
  std::mt19937_64 random(1);
  for (const double h : {-0.8, -0.3, 0.0, 0.45, 0.9}) {
    // Seen from the origin the edge x = h/2 at height 5 runs across the disc at x = h.
    const geometry::TriangleVertices half{{h / 2, -1000, 5}, {h / 2, 1000, 5}, {1000, 0, 5}};
    const std::vector<DiscCover> covers = covers_of(half);
    const double visible = 1 - (std::acos(h) - h * std::sqrt(1 - h * h)) / math::pi;
    for (const int chords : {2, 8, 64})
      CHECK(mean(covers, chords, random, 4000) == doctest::Approx(visible).epsilon(0.002));
    CHECK(std::fabs(mean(covers, 64, random, 1) - visible) < 5e-4);
  }
}

TEST_CASE("a sphere on the axis hides a disc: closed form F3 with equal centers") {
  std::mt19937_64 random(2);
  const geometry::SphereShape ball{{0, 0, 5}, 0.3};
  const std::vector<DiscCover> covers = covers_of(ball);
  const double sine = 0.3 / 5, radius = 10 * sine / std::sqrt(1 - sine * sine);
  CHECK(std::fabs(mean(covers, 64, random, 1) - (1 - radius * radius)) < 1e-3);
}

TEST_CASE("covers that overlap agree with dense point sampling, opaque and clear") {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> spread(-1.2, 1.2), height(2, 9), uniform;
  for (int scene = 0; scene < 40; ++scene) {
    std::vector<geometry::TriangleVertices> triangles;
    std::vector<geometry::SphereShape> spheres;
    std::vector<DiscCover> covers;
    const auto keep = [&](DiscCover cover, bool is_round) {
      cover.is_opaque = covers.size() % 2 == 0;
      const double clear = is_round ? 0.25 : 0.5;
      cover.transmittance = cover.is_opaque ? math::black : math::grey(clear);
      covers.push_back(cover);
    };
    for (int i = 0; i < 4; ++i) {
      const auto vertex = [&] {
        const double z = height(random);
        return Vec3{spread(random) * z / 10, spread(random) * z / 10, z};
      };
      triangles.push_back({vertex(), vertex(), vertex()});
      keep(covers_of(triangles.back()).front(), false);
    }
    for (int i = 0; i < 2; ++i) {
      const double z = height(random);
      spheres.push_back({{spread(random) * z / 10, spread(random) * z / 10, z}, 0.05 * z});
      std::vector<DiscCover> found;
      if (!append_cover(spheres.back(), unit_view(), found)) {
        spheres.pop_back();
        continue;
      }
      keep(found.front(), true);
    }
    constexpr int samples = 40000;
    double sum = 0;
    for (int i = 0; i < samples; ++i) {
      const double radius = std::sqrt(uniform(random)), angle = 2 * math::pi * uniform(random);
      const double x = radius * std::cos(angle), y = radius * std::sin(angle);
      double through = 1;
      for (std::size_t k = 0; k < covers.size(); ++k) {
        const bool is_hidden = k < 4 ? crosses(triangles[k], x, y) : crosses(spheres[k - 4], x, y);
        if (is_hidden) through *= covers[k].is_opaque ? 0 : covers[k].transmittance.r;
      }
      sum += through;
    }
    // Five standard errors of the samples, and of 200 repetitions of 16 chords.
    CHECK(std::fabs(mean(covers, 16, random, 200) - sum / samples) < 5 * 0.5 / std::sqrt(samples) + 2e-3);
  }
}

TEST_CASE("a capped cylinder hides what segments that cross it say") {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> spread(-1, 1), uniform;
  int told = 0;
  for (int i = 0; i < 300; ++i) {
    const double z = 3 + 3 * uniform(random);
    const geometry::CylinderShape cylinder{{spread(random) * z / 8, spread(random) * z / 8, z},
                                           math::normalize({spread(random), spread(random), spread(random)}),
                                           0.05 + 0.3 * uniform(random),
                                           0.1 + 2 * uniform(random),
                                           true};
    std::vector<DiscCover> covers;
    if (!append_cover(cylinder, unit_view(), covers)) continue;
    ++told;
    constexpr int samples = 4000;
    int hidden = 0;
    for (int k = 0; k < samples; ++k) {
      const double radius = std::sqrt((k + 0.5) / samples), angle = k * 2.39996322972865332;
      hidden += crosses(cylinder, radius * std::cos(angle), radius * std::sin(angle)) ? 1 : 0;
    }
    // A spiral of 4000 points is off by less than 4000^−0.75, five times over; 64 chords by less still.
    CHECK(std::fabs(mean(covers, 64, random, 1) - (1 - static_cast<double>(hidden) / samples)) < 1e-2);
  }
  CHECK(told > 250);
}

TEST_CASE("below the horizon the disc is hidden by the surface itself") {
  std::mt19937_64 random(4);
  const std::vector<DiscCover> covers{cover_below_horizon({1, 0, 0}, unit_view())};
  CHECK(std::fabs(mean(covers, 64, random, 1) - 0.5) < 5e-4);
}
