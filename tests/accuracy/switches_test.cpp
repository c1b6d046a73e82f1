// What the engine skips: with each part switched off the image is the same, or as near as both say they are exact.
#include <doctest/doctest.h>

#include "tests/robustness/worlds.h"
#include "tests/support/picture.h"
#include "tests/support/scenes.h"

using namespace penumbra;

namespace {

api::JobRequest small(api::JobRequest job) {
  job.options.width = 80, job.options.height = 60;
  job.options.shadow_samples = 16;
  job.options.transfer = scene::Transfer::linear;
  return job;
}

std::vector<std::pair<const char*, api::JobRequest>> jobs() {
  std::vector<std::pair<const char*, api::JobRequest>> result{{"zoo", small(test::zoo())}};
  for (const char* name : {"room-flat", "teapot"}) result.emplace_back(name, small(test::predecessor(name)));
  for (const char* name : {"hard-and-soft", "glass-and-mirrors", "cow", "thousand-spheres"})
    result.emplace_back(name, small(test::example(name)));
  result.emplace_back(
      "ball", api::parse_job(R"({"scene": {"camera": {"position": [0, 0, 9], "look_at": [0, 0, 0], "vertical_fov": 45},
    "background": [0.2, 0.3, 0.5], "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}],
    "lights": [{"type": "point", "position": [5, 5, 5], "intensity": 1, "radius": 1}]},
    "options": {"width": 128, "height": 128}})"));
  return result;
}

/// An area light that a cell has in full view gets the closed form at points that could not tell.
bool has_area_lights(const api::JobRequest& job) {
  return std::ranges::any_of(job.scene.lights, [](const scene::Light& light) {
    return std::holds_alternative<scene::RectangleLight>(light) || std::holds_alternative<scene::SphereLight>(light);
  });
}

enum class Same { always, without_area_lights, within_error };

void check(const char* what, bool render::Switches::*part, Same same, const char* counter, int shadow_samples = 16) {
  std::uint64_t count = 0;
  for (auto& [name, job] : jobs()) {
    job.options.shadow_samples = shadow_samples;
    render::Switches without;
    without.*part = false;
    const render::Picture on = test::render(job), off = test::render(job, without);
    count += on.stats.skipped.at(counter);
    CHECK_MESSAGE(off.stats.skipped.at(counter) == 0, std::string(counter), " of ", std::string(name));
    if (same == Same::always || (same == Same::without_area_lights && !has_area_lights(job))) {
      CHECK_MESSAGE(on.film->rgb == off.film->rgb, std::string(what), ", ", std::string(name), ", rmse ",
                    test::rmse(on.film->rgb, off.film->rgb));
    } else {
      // Each within three times what it claims, as the test of estimates shows.
      const double bound = 3 * std::hypot(on.stats.estimated_error, off.stats.estimated_error) + 1e-12;
      CHECK_MESSAGE(test::rmse(on.film->rgb, off.film->rgb) <= bound, std::string(what), ", ", std::string(name));
    }
  }
  CHECK_MESSAGE(count > 0, std::string(what));
}

template <bool shading::Switches::*part>
constexpr bool render::Switches::*of_shading = static_cast<bool render::Switches::*>(part);

}  // namespace

TEST_CASE("what is skipped for certain changes no pixel") {
  check("light cells", of_shading<&shading::Switches::light_cells>, Same::without_area_lights, "lights_from_cells");
  for (const int samples : {4, 16})
    check("camera bundles", &render::Switches::camera_bundles, Same::always, "camera_rays_bundled", samples);
  for (const int samples : {4, 16})
    check("shadow bundles", of_shading<&shading::Switches::shadow_bundles>, Same::always, "shadow_rays_bundled",
          samples);
  check("hidden spheres", of_shading<&shading::Switches::hidden_spheres>, Same::always, "hidden_spheres", 32);
  for (const char* counter : {"lights_facing_away", "lights_without_effect"}) {
    for (const int samples : {4, 16})
      check("lights without share", of_shading<&shading::Switches::lights_without_share>, Same::always, counter,
            samples);
  }
  check("empty tiles", &render::Switches::empty_tiles, Same::always, "empty_tiles");
}

TEST_CASE("cells wider than the way to the light change no pixel, and many lights none either") {
  render::Switches without;
  without.light_cells = false;
  const auto check_scene = [&](const api::JobRequest& job) {
    CHECK(test::render(job).film->rgb == test::render(job, without).film->rgb);
  };
  check_scene(api::parse_job(
      R"({"scene": {"camera": {"position": [-0.915, 2.134973, 5], "look_at": [0, 0, 0], "vertical_fov": 50},
    "objects": [{"type": "cylinder", "point": [-1, 0.29834, 0.009], "direction": [0.082, 0.8, 0.917], "radius": 0.339044, "height": 1.8},
      {"type": "plane", "point": [-1.1, -1, 1], "normal": [0.47, 0.015, 0.473814], "material": {"diffuse": [0.33, 0.91, 0.87]}}],
    "lights": [{"type": "point", "position": [-1.3, 3, 1.840683], "intensity": 0.6}]}, "options": {"width": 12, "height": 12}})"));
  test::Random random(61);
  const auto add_light = [&](api::JobRequest& job, const math::Vec3& middle, double reach, double intensity,
                             double radius) {
    job.scene.lights.emplace_back(scene::PointLight{middle + random.in_cube(reach), math::grey(intensity), {}, radius});
  };
  for (int i = 0; i < 60; ++i) {
    api::JobRequest job = test::zoo();
    job.options.width = job.options.height = 8 + static_cast<int>(random.below(8));
    job.options.shadow_samples = 4;
    job.scene.lights.clear();
    for (int k = 0; k < 4; ++k) add_light(job, {0, 1.6, 1}, 1.5, 0.2, k % 2 == 0 ? 0 : 0.05);
    check_scene(job);
  }
  // So many that contents drive each other out.
  api::JobRequest many = test::example("cow");
  many.options.width = many.options.height = 24;
  many.options.shadow_samples = 4;
  many.scene.lights.clear();
  for (int k = 0; k < 600; ++k) add_light(many, {0, 8, 0}, 6, 0.002, 0.2);
  check_scene(many);
}

TEST_CASE("what replaces samples stays within the estimated error") {
  check("shadow candidates", of_shading<&shading::Switches::shadow_candidates>, Same::within_error,
        "lights_from_candidates");
  check("shadow outlines", of_shading<&shading::Switches::shadow_outlines>, Same::within_error, "shadow_rays_covered");
  check("exact area lights", of_shading<&shading::Switches::exact_area_lights>, Same::within_error,
        "area_samples_exact");
  for (const int samples : {2, 4, 8, 16}) {
    check("few rays", of_shading<&shading::Switches::few_rays>, Same::within_error, "lights_from_few_rays", samples);
    check("shared samples", of_shading<&shading::Switches::shared_samples>, Same::within_error,
          "lights_from_neighbours", samples);
    check("agreeing rays", of_shading<&shading::Switches::agreeing_rays>, Same::within_error, "shadow_rays_agreed",
          samples);
  }
  check("merged lights", &render::Switches::merge_lights, Same::within_error, "merged_lights");
}
