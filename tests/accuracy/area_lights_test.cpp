// Area lights: what lines across them tell, and what few samples of points side by side do, against rays of each point.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include "tests/robustness/worlds.h"
#include "tests/support/picture.h"
#include "tests/support/scenes.h"

using namespace penumbra;
using math::Vec3;

namespace {

std::string text(const Vec3& v) { return fmt::format("[{}, {}, {}]", v.x, v.y, v.z); }

/// A floor, and things on it, one of which stands where its foot is seen at the edge of a light that stands there, too.
api::JobRequest world(const std::string& light, test::Random& random, const std::string& material) {
  const auto place = [&](double height) { return Vec3{random.between(-1.5, 1.5), height, random.between(-1.5, 1.5)}; };
  const Vec3 foot = place(0), beside = foot + Vec3{0.5, 0, -0.8};
  return api::parse_job(fmt::format(
      R"({{"scene": {{"camera": {{"position": [-2, 5, 7], "look_at": [0, 0.5, 0], "vertical_fov": 40}}, "ambient": 0.05,
      "objects": [{{"type": "polygon", "vertices": [[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]], "material": {}}},
      {{"type": "triangle", "vertices": [{}, {}, {}]}}, {{"type": "sphere", "center": {}, "radius": 0.4}},
      {{"type": "mesh", "positions": [0.6,0,0.6, 1.4,0,0.6, 1,0,1.4, 1,1.2,0.9], "indices": [0,1,2, 0,3,1, 1,3,2, 2,3,0]}}],
      "lights": [{}]}}, "options": {{"width": 24, "height": 20, "max_depth": 0}}}})",
      material, text(foot), text(beside), text(foot + Vec3{0, 1, 0}), text(place(0.6)), light));
}

std::string random_light(test::Random& random, int kind) {
  const double x = random.between(-2, 2), z = random.between(-6, -4), width = random.between(0.5, 2.5);
  if (kind == 0)  // on the floor
    return fmt::format(
        R"({{"type": "rectangle", "corner": [{}, 0, {}], "edge_u": [{}, 0, 0], "edge_v": [0, 1.8, 0], "intensity": 4}})",
        x, z, width);
  if (kind == 1)  // tilted, above
    return fmt::format(
        R"({{"type": "rectangle", "corner": [{}, 4.5, 0], "edge_u": [{}, 0.3, 0], "edge_v": [0, -0.4, 1.2], "intensity": 5}})",
        x, width);
  return fmt::format(R"({{"type": "sphere", "center": [{}, 4, {}], "radius": {}, "intensity": 8}})", x, 0.3 * z,
                     0.3 * width);
}

constexpr const char* shiny = R"({"diffuse": 0.6, "specular": 0.3, "shininess": 9})";

}  // namespace

TEST_CASE("lines across an area light tell what rays to it do") {
  test::Random random(5);
  render::Switches rays;
  rays.shadow_outlines = rays.few_rays = false;
  for (int i = 0; i < 24; ++i) {
    api::JobRequest job = world(random_light(random, i % 3), random, i % 2 == 0 ? shiny : R"({"diffuse": 0.8})");
    INFO(fmt::format("light {}", i));
    job.options.shadow_samples = 4096;
    const render::Picture truth = test::render(job, rays);
    job.options.shadow_samples = 1024;
    const render::Picture seen = test::render(job);
    CHECK(seen.stats.skipped.at("shadow_rays_covered") > 0);
    CHECK(test::rmse(seen.film->rgb, truth.film->rgb) < 4e-4);
    double most = 0;
    for (std::size_t k = 0; k < seen.film->rgb.size(); ++k)
      most =
          std::max(most, std::fabs(static_cast<double>(seen.film->rgb[k]) - static_cast<double>(truth.film->rgb[k])));
    CHECK(most < 6e-3);
  }
}

TEST_CASE("an edge that only just reaches into an area light's rim hides what it should") {
  // The light and the triangle stand on the floor, from which they are seen: the triangle's foot lies in the light's
  // rim.
  api::JobRequest job = api::parse_job(R"({"scene": {"camera": {"position": [-3, 5, 8], "direction": [0.6, -0.67, -0.6],
      "vertical_fov": 10}, "objects": [{"type": "polygon", "vertices": [[0, 0, 5], [5, 0, 0], [0, 0, 0], [-5, 0, 0]]},
      {"type": "triangle", "vertices": [[0, 0, 0], [0.5, 0, -0.8], [0, 1, 0]]}],
      "lights": [{"type": "rectangle", "corner": [0, 0, -2], "edge_u": [2.25, 0, 0], "edge_v": [0, 1.85, 0],
      "intensity": 4}]}, "options": {"width": 24, "height": 24, "shadow_samples": 1024}})");
  render::Switches rays;
  rays.shadow_outlines = rays.few_rays = false;
  CHECK(test::rmse(test::render(job).film->rgb, test::render(job, rays).film->rgb) < 1e-4);
  // By less than what a place on the edge is rounded to.
  job = api::parse_job(R"({"scene": {"camera": {"position": [-1.52, 3.5, 0], "look_at": [0, 0, 0], "vertical_fov": 40},
      "objects": [{"type": "polygon", "vertices": [[0, 0, 0], [5, 0, 5], [5, 0, -5], [0, 0, -5]]},
      {"type": "triangle", "vertices": [[1, 0, -1.2], [0, 0, -1], [0, 1.2, 0]]}],
      "lights": [{"type": "rectangle", "corner": [0, 0, -2], "edge_u": [2.62, 0, 0], "edge_v": [0, 1.54, 0],
      "intensity": 5}]}, "options": {"width": 20, "height": 20, "shadow_samples": 1024}})");
  CHECK(test::rmse(test::render(job).film->rgb, test::render(job, rays).film->rgb) < 1e-4);
}

TEST_CASE("few samples of an area light are right on average, and none is darker than black") {
  test::Random random(6);
  for (int kind = 0; kind < 3; ++kind) {
    api::JobRequest job = world(random_light(random, kind), random, shiny);
    job.options.shadow_samples = 1024;
    const render::Picture truth = test::render(job);
    constexpr int seeds = 64;
    std::vector<double> sum(truth.film->rgb.size());
    double squared = 0;
    job.options.shadow_samples = 4;
    for (int seed = 0; seed < seeds; ++seed) {
      job.options.seed = static_cast<std::uint64_t>(seed);
      const render::Picture picture = test::render(job);
      CHECK(picture.stats.skipped.at("lights_from_few_rays") > 0);
      const double error = test::rmse(picture.film->rgb, truth.film->rgb);
      squared += error * error / seeds;
      for (std::size_t k = 0; k < sum.size(); ++k) {
        sum[k] += picture.film->rgb[k] / seeds;
        REQUIRE(picture.film->rgb[k] >= 0);
      }
    }
    double apart = 0;
    for (std::size_t k = 0; k < sum.size(); ++k) {
      const double off = sum[k] - static_cast<double>(truth.film->rgb[k]);
      apart += off * off / static_cast<double>(sum.size());
    }
    INFO(fmt::format("kind {}: RMSE {}, of the mean of {}: {}", kind, std::sqrt(squared), seeds, std::sqrt(apart)));
    // What samples share, and agree on by chance, leans: by a third of their error at most.
    CHECK(std::sqrt(apart) < std::sqrt(squared) * (1 / std::sqrt(seeds) + 0.33));
  }
}
