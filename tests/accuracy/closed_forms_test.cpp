// Closed forms F1 to F4 and F6 of unoccluded and half-hidden lights, each as a scene of one pixel through the whole
// renderer: the mean over 64 seeds within 3 standard errors (or rounding, where the answer is exact).
#include <doctest/doctest.h>
#include <fmt/format.h>

#include "engine/math/elementary.h"
#include "tests/support/picture.h"

using namespace penumbra;
using math::pi;

namespace {

constexpr int seeds = 64;

/// Red of the one pixel that looks straight down at the origin of the floor y = 0, from just above it. Objects and
/// lights are JSON; the floor is white, or shines evenly in all directions (specular with shininess 0).
struct Measured {
  double mean, standard_error;
};
Measured measure(const std::string& objects, const std::string& light, const std::string& floor = R"({"diffuse": 1})",
                 int samples = 64) {
  api::JobRequest job = api::parse_job(fmt::format(
      R"({{"scene": {{"camera": {{"position": [0, 0.01, 0], "direction": [0, -1, 0], "up": [0, 0, -1],
          "view_plane": {{"width": 1e-9, "height": 1e-9, "distance": 1}}}},
          "objects": [{{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": {}}}{}], "lights": [{}]}},
          "options": {{"width": 1, "height": 1, "shadow_samples": {}}}}})",
      floor, objects, light, samples));
  double sum = 0, squares = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    job.options.seed = static_cast<std::uint64_t>(seed);
    const double value = test::render(job).film->rgb[0];
    sum += value, squares += value * value;
  }
  const double mean = sum / seeds;
  return {mean, std::sqrt(std::max(0.0, squares / seeds - mean * mean) / (seeds - 1))};
}

void check(const char* what, const Measured& found, double expected) {
  const double tolerance = 3 * found.standard_error + 1e-6 * std::max(1.0, std::fabs(expected));
  MESSAGE(what, ": ", found.mean, " ± ", found.standard_error, ", closed form ", expected);
  CHECK(std::fabs(found.mean - expected) <= tolerance);
}

const std::string even = R"({"specular": 1, "shininess": 0})";

}  // namespace

TEST_CASE("F1: irradiance of a sphere light, above and across the horizon") {
  for (const auto& [distance, omega] :
       {std::pair{2.0, 0.5}, {2.0, 1.2}, {2.0, 1.6}, {2.0, 2.0}, {5.0, 1.5}, {1.2, 1.0}, {1.2, 2.2}}) {
    const double h = distance, s = std::sqrt(h * h - 1);
    double expected = 0;
    if (omega <= std::acos(1 / h)) {
      expected = std::cos(omega) / (h * h);
    } else if (omega < pi - std::acos(1 / h)) {
      const double t = std::tan(omega), hc = h * std::cos(omega);
      expected = 0.5 - std::asin(s / (h * std::sin(omega))) / pi +
                 (std::cos(omega) * std::acos(-s / t) - s * std::sqrt(1 - hc * hc)) / (pi * h * h);
    }
    const std::string light = fmt::format(R"({{"type": "sphere", "center": [{}, {}, 0], "radius": 1, "intensity": 1}})",
                                          h * std::sin(omega), h * std::cos(omega));
    check("F1", measure("", light), expected);
  }
}

TEST_CASE("F2: a half-plane across a disc light") {
  for (const double h : {-0.7, 0.0, 0.6}) {
    // The edge x = h/2 half way up hides the disc from x = h on.
    const std::string half = fmt::format(
        R"(, {{"type": "polygon", "vertices": [[{0}, 5, -99], [99, 5, -99], [99, 5, 99], [{0}, 5, 99]]}})", h / 2);
    const std::string light = R"({"type": "point", "position": [0, 10, 0], "intensity": 1, "radius": 1})";
    check("F2", measure(half, light), 1 - (std::acos(h) - h * std::sqrt(1 - h * h)) / pi);
  }
}

TEST_CASE("F3: a disc in front of a disc light") {
  for (const auto& [rho, c] : {std::pair{0.7, 0.9}, {1.0, 0.5}, {0.4, 0.2}}) {
    // Half way up, half as large; a cylinder as flat as can be is a disc.
    const std::string disc = fmt::format(
        R"(, {{"type": "cylinder", "point": [{}, 5, 0], "direction": [0, 1, 0], "radius": {}, "height": 1e-9}})", c / 2,
        rho / 2);
    const std::string light = R"({"type": "point", "position": [0, 10, 0], "intensity": 1, "radius": 1})";
    double area = pi * rho * rho;
    if (c > 1 - rho) {
      area = std::acos((c * c + 1 - rho * rho) / (2 * c)) +
             rho * rho * std::acos((c * c + rho * rho - 1) / (2 * c * rho)) -
             0.5 * std::sqrt((-c + 1 + rho) * (c + 1 - rho) * (c - 1 + rho) * (c + 1 + rho));
    }
    check("F3", measure(disc, light), 1 - area / pi);
  }
}

TEST_CASE("F4: a sphere in front of a sphere light") {
  const double d = 10;
  for (const auto& [alpha, beta, gamma] :
       {std::array{0.3, 0.2, 0.35}, {0.3, 0.4, 0.2}, {0.1, 0.05, 0.08}, {0.2, 0.1, 0.05}}) {
    double hidden = 2 * pi * (1 - std::cos(std::min(alpha, beta)));
    if (gamma > std::fabs(alpha - beta)) {
      const double c =
          std::acos((std::cos(gamma) - std::cos(alpha) * std::cos(beta)) / (std::sin(alpha) * std::sin(beta)));
      const double a =
          std::acos((std::cos(beta) - std::cos(gamma) * std::cos(alpha)) / (std::sin(gamma) * std::sin(alpha)));
      const double b =
          std::acos((std::cos(alpha) - std::cos(gamma) * std::cos(beta)) / (std::sin(gamma) * std::sin(beta)));
      hidden = 2 * (pi - c - a * std::cos(alpha) - b * std::cos(beta));
    }
    const std::string light = fmt::format(R"({{"type": "sphere", "center": [0, {}, 0], "radius": {}, "intensity": 1}})",
                                          d, d * std::sin(alpha));
    const std::string ball = fmt::format(R"(, {{"type": "sphere", "center": [{}, {}, 0], "radius": {}}})",
                                         3 * std::sin(gamma), 3 * std::cos(gamma), 3 * std::sin(beta));
    // A surface that shines evenly measures the solid angle itself.
    check("F4", measure(ball, light, even), (2 * pi * (1 - std::cos(alpha)) - hidden) / pi);
  }
}

TEST_CASE("F6: Lambert's polygon, wholly in view and cut by the horizon") {
  using math::Vec3;
  struct Lamp {
    Vec3 corner, u, v;
  };
  for (const Lamp& lamp : {Lamp{{-0.5, 2, -0.5}, {1, 0, 0}, {0, 0, 1}},
                           {{-3, 0.5, -2}, {2, 1, 0}, {0, 0, 3}},
                           {{2, -1, -1}, {0, 0, 2}, {0, 3, 0}}}) {
    std::vector<Vec3> corners{lamp.corner, lamp.corner + lamp.u, lamp.corner + lamp.u + lamp.v, lamp.corner + lamp.v},
        above;
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec3 &a = corners[i], &b = corners[(i + 1) % 4];
      if (a.y > 0) above.push_back(a);
      if ((a.y > 0) != (b.y > 0)) above.push_back(a + (b - a) * (a.y / (a.y - b.y)));
    }
    double sum = 0;
    for (std::size_t i = 0; i < above.size(); ++i) {
      const Vec3 a = math::normalize(above[i]), b = math::normalize(above[(i + 1) % above.size()]),
                 c = math::cross(a, b);
      sum += std::acos(math::dot(a, b)) * c.y / math::length(c);
    }
    const double expected = std::fabs(sum) / 2 / pi;
    // One-sided along u × v: the edges are given so that it shines on the origin.
    const bool faces = math::dot(math::cross(lamp.u, lamp.v), lamp.corner) < 0;
    const Vec3 u = faces ? lamp.u : lamp.v, v = faces ? lamp.v : lamp.u;
    const std::string light = fmt::format(
        R"({{"type": "rectangle", "corner": [{}, {}, {}], "edge_u": [{}, {}, {}], "edge_v": [{}, {}, {}], "intensity": 1}})",
        lamp.corner.x, lamp.corner.y, lamp.corner.z, u.x, u.y, u.z, v.x, v.y, v.z);
    check("F6", measure("", light), expected);
    if (above.size() != 4 || above.front() != corners.front()) continue;
    // A surface that shines evenly, whose light is sampled, measures the solid angle: Girard's spherical excess.
    double excess = -2 * pi;
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec3 &before = corners[(i + 3) % 4], &at = corners[i], &after = corners[(i + 1) % 4];
      const Vec3 m = math::normalize(math::cross(at, before)), n = math::normalize(math::cross(at, after));
      excess += std::acos(math::dot(m, n));
    }
    check("solid angle of a rectangle", measure("", light, even), excess / pi);
  }
}
