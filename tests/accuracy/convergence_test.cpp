// How fast the error falls with the number of samples: the slope of log RMSE over log N between 4 and 256.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include "engine/math/elementary.h"
#include "tests/support/picture.h"

using namespace penumbra;

namespace {

double slope(const std::vector<std::pair<int, double>>& errors) {
  double x = 0, y = 0, xx = 0, xy = 0;
  for (const auto& [n, error] : errors) {
    const double u = std::log(n), v = std::log(error);
    x += u, y += v, xx += u * u, xy += u * v;
  }
  const auto count = static_cast<double>(errors.size());
  return (count * xy - x * y) / (count * xx - x * x);
}

/// A floor seen from above, under a half-plane at height 10 whose edge is the line x = 0, and a sun straight above with
/// a wide disc: the floor's pixels cross the penumbra, and their light is closed form F2.
double penumbra_rmse(int samples, bool use_candidates) {
  constexpr int width = 64, height = 16;
  api::JobRequest job = api::parse_job(fmt::format(R"({{"scene": {{
      "camera": {{"position": [0, 5, 0], "direction": [0, -1, 0], "up": [0, 0, -1], "projection": "orthographic",
                 "view_plane": {{"width": 2, "height": 2}}}},
      "objects": [{{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": {{"diffuse": 1}}}},
                  {{"type": "polygon", "vertices": [[0, 10, -999], [0, 10, 999], [999, 10, 999], [999, 10, -999]]}}],
      "lights": [{{"type": "directional", "direction": [0, -1, 0], "intensity": 1, "angular_radius": {}}}]}},
      "options": {{"width": {}, "height": {}, "shadow_samples": {}}}}})",
                                                   std::atan(0.1) * 180 / math::pi, width, height, samples));
  double squares = 0;
  constexpr int seeds = 8;
  for (int seed = 0; seed < seeds; ++seed) {
    job.options.seed = static_cast<std::uint64_t>(seed);
    const render::Film film = *test::render(job, test::with_candidates(use_candidates)).film;
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        const double h = -((column + 0.5) / width - 0.5) * 2;  // in radii of the disc
        const double visible = 1 - (std::acos(h) - h * std::sqrt(1 - h * h)) / math::pi;
        const double d = film.rgb[film.offset(column, row)] - visible;
        squares += d * d;
      }
    }
  }
  return std::sqrt(squares / (seeds * width * height));
}

/// A bright half-plane whose edge crosses the pixels at a slant, box-filtered: each pixel's covered area is known.
double edge_rmse(int samples) {
  constexpr int size = 24;
  constexpr double tilt = 0.37;  // the edge is y = tilt·x
  api::JobRequest job = api::parse_job(fmt::format(R"({{"scene": {{
      "camera": {{"position": [0, 0, 5], "direction": [0, 0, -1], "projection": "orthographic", "view_plane": {{"width": {0}, "height": {0}}}}},
      "objects": [{{"type": "triangle", "vertices": [[-999, {1}, 0], [999, {2}, 0], [0, -9999, 0]], "material": {{"emission": 1}}}}]}},
      "options": {{"width": {0}, "height": {0}, "samples_per_pixel": {3}}}}})",
                                                   size, -999 * tilt, 999 * tilt, samples));
  double squares = 0;
  int edges = 0;
  constexpr int seeds = 32;
  for (int seed = 0; seed < seeds; ++seed) {
    job.options.seed = static_cast<std::uint64_t>(seed);
    const render::Film film = *test::render(job).film;
    for (int row = 0; row < size; ++row) {
      for (int column = 0; column < size; ++column) {
        const double x = column - size / 2.0, y = size / 2.0 - row - 1;
        // ∫ of the covered height over the pixel's width, exact for fine enough steps of a piecewise linear function.
        double area = 0;
        constexpr int steps = 4000;
        for (int i = 0; i < steps; ++i) area += std::clamp(tilt * (x + (i + 0.5) / steps) - y, 0.0, 1.0) / steps;
        if (area < 1e-9 || area > 1 - 1e-9) continue;
        const double d = film.rgb[film.offset(column, row)] - area;
        squares += d * d;
        ++edges;
      }
    }
  }
  return std::sqrt(squares / edges);
}

}  // namespace

TEST_CASE("the error of a soft shadow falls like N^-0.65 or faster") {
  for (const bool use_candidates : {true, false}) {
    std::vector<std::pair<int, double>> errors;
    for (const int n : {4, 16, 64, 256}) {
      errors.emplace_back(n, penumbra_rmse(n, use_candidates));
      MESSAGE((use_candidates ? "outlines, N = " : "rays, N = "), n, ": RMSE ", errors.back().second);
    }
    MESSAGE("slope ", slope(errors));
    CHECK(slope(errors) <= -0.65);
    // The published figures of a well-spread pattern, with room for chance.
    CHECK(errors[2].second < 0.016);
  }
}

TEST_CASE("the error of a pixel's camera samples falls like N^-0.65 or faster") {
  std::vector<std::pair<int, double>> errors;
  for (const int n : {4, 16, 64, 256}) {
    errors.emplace_back(n, edge_rmse(n));
    MESSAGE("camera samples ", n, ": RMSE ", errors.back().second);
  }
  MESSAGE("slope ", slope(errors));
  CHECK(slope(errors) <= -0.65);
}
