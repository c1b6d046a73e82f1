#include "tests/accuracy/estimate_scenes.h"

#include <fmt/format.h>
#include <algorithm>
#include <numeric>

#include "engine/math/elementary.h"
#include "tests/support/picture.h"
#include "tests/support/scenes.h"

namespace penumbra::test {
namespace {

const std::string floor =
    R"({"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": {"diffuse": [0.8, 0.7, 0.6]}})";
const std::string balls = R"(
    {"type": "sphere", "center": [-1.5, 1, 0], "radius": 1, "material": {"diffuse": 0.6, "specular": 0.4, "shininess": 30}},
    {"type": "sphere", "center": [1.2, 0.6, 1], "radius": 0.6}, {"type": "sphere", "center": [0.6, 2.2, -1], "radius": 0.5})";
const std::string box =
    R"({"type": "mesh", "positions": [-1,0,-1, 1,0,-1, 1,0,1, -1,0,1, -1,2,-1, 1,2,-1, 1,2,1, -1,2,1],
    "indices": [0,1,2, 0,2,3, 4,6,5, 4,7,6, 0,5,1, 0,4,5, 1,6,2, 1,5,6, 2,7,3, 2,6,7, 3,4,0, 3,7,4]})";
const std::string soft_light = R"({"type": "point", "position": [3, 6, 3], "intensity": 0.8, "radius": 0.7})";

/// A bumpy ball of 2·n² triangles, smooth or not.
std::string bumpy_ball(int n, bool is_smooth) {
  std::string positions, indices, normals;
  for (int ring = 0; ring <= n; ++ring) {
    for (int k = 0; k <= n; ++k) {
      const auto [st, ct] = math::sine_cosine_turns(0.5 * ring / n);
      const auto [sp, cp] = math::sine_cosine_turns(1.0 * k / n);
      const double r =
          1.3 + 0.2 * math::sine_cosine_turns(5.0 * k / n).sine * math::sine_cosine_turns(2.0 * ring / n).cosine;
      positions += fmt::format("{}{},{},{}", positions.empty() ? "" : ",", r * st * cp, r * ct + 1.4, r * st * sp);
      normals += fmt::format("{}{},{},{}", normals.empty() ? "" : ",", st * cp, ct, st * sp);
      if (ring == n || k == n) continue;
      const int a = ring * (n + 1) + k, b = a + n + 1;
      indices += fmt::format("{}{},{},{},{},{},{}", indices.empty() ? "" : ",", a, a + 1, b, a + 1, b + 1, b);
    }
  }
  return fmt::format(R"({{"type": "mesh", "positions": [{}], "indices": [{}]{}}})", positions, indices,
                     is_smooth ? fmt::format(R"(, "normals": [{}])", normals) : "");
}

std::string ring_of_lights(int count) {
  std::string lights;
  for (int i = 0; i < count; ++i) {
    const auto [s, c] = math::sine_cosine_turns(1.0 * i / count);
    lights += fmt::format(
        R"({}{{"type": "point", "position": [{}, {}, {}], "intensity": {}, "radius": 0.5, "attenuation": [0.5, 0.02, 0.01]}})",
        i == 0 ? "" : ",", 5 * c, 4 + 0.3 * i, 5 * s, 0.15 + 0.02 * i);
  }
  return lights;
}

NamedJob made(const std::string& name, const std::string& objects, const std::string& lights,
              const std::string& options = "", const std::string& camera = "") {
  return {name, api::parse_job(fmt::format(
                    R"({{"scene": {{"camera": {{"position": [0, 4, 9], "look_at": [0, 0.9, 0], "vertical_fov": 40{}}},
                        "ambient": 0.05, "objects": [{}], "lights": [{}]}},
                        "options": {{"width": 44, "height": 36{}}}}})",
                    camera, objects, lights, options))};
}

NamedJob reduced(const std::string& label, api::JobRequest job, int samples_per_pixel = 1) {
  NamedJob result{label, std::move(job)};
  result.job.options.samples_per_pixel = samples_per_pixel;
  result.job.options.width = result.job.options.height = 36;
  return result;
}

const std::string pane =
    R"({"type": "polygon", "vertices": [[-1,0.2,2],[1.4,0.2,2.4],[1.4,2,2.2],[-1,2,1.8]], "material": {"transmission": [0.9, 0.4, 0.2]}})";
const std::string glass =
    R"({"type": "sphere", "center": [0, 1, 2], "radius": 0.9, "material": {"transmission": [0.8, 0.9, 0.95], "reflection": 0.1, "ior": 1.5}})";
const std::string mirror =
    R"({"type": "polygon", "vertices": [[-4,0,-2],[4,0,-2],[4,4,-2],[-4,4,-2]], "material": {"diffuse": 0.1, "reflection": 0.8}})";
const std::string cans =
    R"({"type": "cylinder", "point": [-1,0,0], "direction": [0.2,1,0.1], "radius": 0.7, "height": 2}, {"type": "tube", "point": [0,2.5,-1], "direction": [1,0.1,0.3], "radius": 0.3}, {"type": "cylinder", "point": [1.2,0,1], "direction": [0,1,0], "radius": 0.5, "height": 1, "caps": false})";
const std::string rectangle =
    R"({"type": "rectangle", "corner": [-1, 5, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2], "intensity": 6})";
const std::string sphere_light = R"({"type": "sphere", "center": [2, 5, 2], "radius": 0.8, "intensity": 9})";
const std::string hard = R"({"type": "point", "position": [3, 6, 3], "intensity": 0.8})";

}  // namespace

std::vector<NamedJob> estimate_scenes() {
  const std::string scene = floor + "," + balls, boxed = floor + "," + box,
                    lens = R"(, "lens": {"aperture_radius": 0.3, "focus_distance": 9})";
  std::vector<NamedJob> jobs{
      made("balls, soft light", scene, soft_light),
      made("balls, small light", scene,
           R"({"type": "point", "position": [3, 6, 3], "intensity": 0.8, "radius": 0.08})"),
      made("balls, huge light", scene, R"({"type": "point", "position": [3, 6, 3], "intensity": 0.8, "radius": 4})"),
      made("balls, eight soft lights", scene, ring_of_lights(8)),
      made("box, soft light", boxed, soft_light),
      made("box, eight soft lights", boxed, ring_of_lights(8)),
      made("bumpy mesh, soft light", floor + "," + bumpy_ball(40, false), soft_light),
      made(
          "smooth mesh, sun and spot", floor + "," + bumpy_ball(24, true),
          R"({"type": "directional", "direction": [-1,-2,-0.5], "intensity": 0.5, "angular_radius": 4}, {"type": "spot", "position": [-4,6,3], "direction": [4,-6,-3], "intensity": 0.6, "cutoff": 25, "exponent": 3, "radius": 0.5})"),
      made("cans, soft light", floor + "," + cans, soft_light),
      made("balls, rectangle", scene, rectangle),
      made(
          "box, rectangle from the side", boxed,
          R"({"type": "rectangle", "corner": [4, 0.1, -2], "edge_u": [0, 0, 4], "edge_v": [0, 3, 0], "intensity": 2})"),
      made("box, sphere light", boxed, sphere_light),
      made("mesh, sphere light and rectangle", floor + "," + bumpy_ball(24, true), sphere_light + "," + rectangle),
      made("coloured panes", scene + "," + pane, soft_light + "," + ring_of_lights(2)),
      made("glass ball", scene + "," + glass, soft_light),
      made("mirror", scene + "," + mirror, soft_light),
      made("overexposed", scene, R"({"type": "point", "position": [3, 6, 3], "intensity": 2.5, "radius": 0.7})"),
      made("hard light, 4 camera rays", scene, hard, R"(, "samples_per_pixel": 4)"),
      made("hard light, 16 camera rays", boxed + "," + mirror, hard, R"(, "samples_per_pixel": 16)"),
      made("soft light, 2 camera rays", scene, soft_light, R"(, "samples_per_pixel": 2)"),
      made("soft light, 16 camera rays", scene + "," + pane, soft_light, R"(, "samples_per_pixel": 16)"),
      made("rectangle, 16 camera rays", boxed, rectangle, R"(, "samples_per_pixel": 16)"),
      made("lens, 1 camera ray", scene, soft_light, "", lens),
      made("lens, 16 camera rays", scene, soft_light, R"(, "samples_per_pixel": 16)", lens),
      made("lens and hard light, 64 camera rays", scene, hard, R"(, "samples_per_pixel": 64)", lens),
      reduced("room-flat", predecessor("room-flat")),
      reduced("teapot", predecessor("teapot")),
      reduced("cow", example("cow")),
      reduced("glass-and-mirrors", example("glass-and-mirrors")),
      reduced("hard-and-soft, 4 camera rays", example("hard-and-soft"), 4),
      {"zoo", zoo()},
  };
  for (NamedJob& named : jobs) {
    named.job.options.target_error.reset();
    named.job.options.threads = scene::all_threads;
    // So large that it is not the luck of a dozen pixels that tells.
    if (named.name == "balls, small light") named.job.options.width = 176, named.job.options.height = 144;
  }
  jobs.back().job.options.width = 48, jobs.back().job.options.height = 36;
  return jobs;
}

Reference reference_of(api::JobRequest job) {
  job.options.seed = 1001;
  render::Film::Values a = render(job).film->rgb;
  job.options.seed = 1002;
  const render::Film::Values b = render(job).film->rgb;
  const double difference = rmse(a, b);
  for (std::size_t i = 0; i < a.size(); ++i)
    a[i] = std::midpoint(std::clamp(a[i], 0.F, 1.F), std::clamp(b[i], 0.F, 1.F));
  return {std::move(a), difference * difference / 4};
}

}  // namespace penumbra::test
