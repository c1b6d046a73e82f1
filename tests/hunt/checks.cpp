#include "tests/hunt/checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tests/hunt/error_checks.h"

namespace penumbra::hunt {
namespace {

using Values = render::Film::Values;
using render::Switches;

struct Part {
  const char* name;
  bool Switches::*flag;
  enum class Same { always, unless_weighed, within_error } same;
};

template <bool shading::Switches::*part>
constexpr bool Switches::*of_shading = static_cast<bool Switches::*>(part);

using enum Part::Same;
constexpr std::array parts{Part{"shadow_candidates", of_shading<&shading::Switches::shadow_candidates>, within_error},
                           Part{"shadow_outlines", of_shading<&shading::Switches::shadow_outlines>, within_error},
                           Part{"few_rays", of_shading<&shading::Switches::few_rays>, within_error},
                           Part{"agreeing_rays", of_shading<&shading::Switches::agreeing_rays>, within_error},
                           Part{"shared_samples", of_shading<&shading::Switches::shared_samples>, within_error},
                           Part{"shadow_bundles", of_shading<&shading::Switches::shadow_bundles>, always},
                           Part{"hidden_spheres", of_shading<&shading::Switches::hidden_spheres>, always},
                           Part{"exact_area_lights", of_shading<&shading::Switches::exact_area_lights>, within_error},
                           Part{"light_cells", of_shading<&shading::Switches::light_cells>, unless_weighed},
                           Part{"light_tree", of_shading<&shading::Switches::light_tree>, unless_weighed},
                           Part{"drawn_lights", of_shading<&shading::Switches::drawn_lights>, within_error},
                           Part{"lights_without_share", of_shading<&shading::Switches::lights_without_share>, always},
                           Part{"merge_lights", &Switches::merge_lights, within_error},
                           Part{"camera_bundles", &Switches::camera_bundles, always},
                           Part{"empty_tiles", &Switches::empty_tiles, always}};

int level(float value, scene::Transfer transfer) {
  const double v = std::clamp<double>(value, 0, 1);
  const double encoded = transfer == scene::Transfer::linear ? v
                         : v <= 0.0031308                    ? 12.92 * v
                                                             : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
  return static_cast<int>(std::lround(encoded * 255));
}

std::string place(const api::JobRequest& job, std::size_t value) {
  const std::size_t pixel = value / 3, width = static_cast<std::size_t>(job.options.width);
  return "pixel (" + std::to_string(pixel % width) + ", " + std::to_string(pixel / width) + ")";
}

/// Where `b` is not the bytes of `a`; one level on hardly any pixel is forgiven to what transmits.
void compare(const api::JobRequest& job, const std::string& kind, const Values& a, const Values& b, Report& report) {
  const bool transmits = std::ranges::any_of(job.scene.materials,
                                             [](const scene::Material& m) { return !math::is_black(m.transmission); });
  std::size_t different = 0, where = 0;
  int most = 0;
  double apart = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i]))) continue;
    const int levels = std::abs(level(a[i], job.options.transfer) - level(b[i], job.options.transfer));
    if (transmits && levels == 0) continue;
    ++different;
    if (levels >= most) most = levels, where = i;
    apart = std::max(apart, std::fabs(static_cast<double>(a[i]) - b[i]));
  }
  const double forgiven = transmits ? std::max(1.0, 1e-4 * static_cast<double>(a.size()) / 3) : 0;
  if (different == 0 || (most <= 1 && static_cast<double>(different) <= 3 * forgiven)) return;
  char text[300];
  std::snprintf(text, sizeof text, "%zu values differ, by %.3g and %d of 255 levels at most; %s: %.8g and %.8g",
                different, apart, most, place(job, where).c_str(), static_cast<double>(a[where]),
                static_cast<double>(b[where]));
  report.findings.push_back(
      {kind, text, static_cast<int>(where / 3) % job.options.width, static_cast<int>(where / 3) / job.options.width});
}

void check_finite(const api::JobRequest& job, const Values& rgb, Report& report) {
  const auto bad = std::ranges::find_if(rgb, [](float v) { return !std::isfinite(v) || v < 0; });
  if (bad == rgb.end()) return;
  const auto at = static_cast<std::size_t>(bad - rgb.begin());
  report.findings.push_back({"not-finite", place(job, at) + " is " + std::to_string(*bad)});
}

void check_structures(const api::JobRequest& job, Renderer& renderer, const Values& rgb, Report& report) {
  using enum scene::Acceleration;
  for (const auto& [name, acceleration] :
       {std::pair{"none", none}, {"cbr", cbr}, {"groups", groups}, {"median", median}, {"bvh", bvh}}) {
    if (acceleration == job.options.acceleration) continue;
    Renderer::Change change;
    change.acceleration = acceleration;
    compare(job, std::string("acceleration-") + name, rgb, renderer(change).film->rgb, report);
  }
  for (const int threads : {0, 3}) {
    Renderer::Change change;
    change.threads = threads;
    const Values other = renderer(change).film->rgb;
    if (other != rgb)
      report.findings.push_back({"threads", "another picture with threads = " + std::to_string(threads)});
  }
}

bool has_area_lights(const api::JobRequest& job) {
  return std::ranges::any_of(job.scene.lights, [](const scene::Light& light) {
    return std::holds_alternative<scene::RectangleLight>(light) || std::holds_alternative<scene::SphereLight>(light);
  });
}

/// A light in the surface's own plane leaves 1e-17 of nothing.
bool differs(const Values& a, const Values& b) {
  return !std::ranges::equal(a, b, [](float x, float y) { return x == y || std::fabs(x - y) < 1e-12f; });
}

void check_switches(const api::JobRequest& job, Renderer& renderer, const Values& rgb, Report& report) {
  for (const Part& part : parts) {
    if (part.same == within_error) continue;
    // With a target, what is known for certain has a say in how many samples others get.
    if (part.same == unless_weighed && (has_area_lights(job) || job.options.target_error)) continue;
    Renderer::Change change;
    change.switches.*part.flag = false;
    const Values other = renderer(change).film->rgb;
    if (differs(rgb, other)) compare(job, std::string("switch-") + part.name, rgb, other, report);
  }
}

/// What is the same but for sampling is the truth's affair, with one part at a time switched off.
void check_pixels(const api::JobRequest& job, Renderer& renderer, std::uint64_t seed, Check checks, Report& report) {
  const auto has = [&](Check check) { return (static_cast<unsigned>(checks) & static_cast<unsigned>(check)) != 0; };
  Judge judge(job, {}, seed);
  judge.run(report);
  if (!report.findings.empty()) return;
  if (has(Check::samples)) check_samples(job, renderer, judge, report);
  if (!has(Check::switches)) return;
  const Part& part = parts[static_cast<std::size_t>(Random(seed, 3).below(static_cast<int>(parts.size())))];
  if (part.same == always) return;
  Renderer::Change change;
  change.switches.*part.flag = false;
  Report other;
  Judge(job, change, seed + 1).run(other);
  for (const Finding& finding : other.findings)
    report.findings.push_back({std::string("without-") + part.name, finding.detail, finding.column, finding.row});
}

}  // namespace

Check check_of(const std::string& kind) {
  if (kind.starts_with("acceleration") || kind == "threads") return Check::structures;
  if (kind.starts_with("switch")) return Check::switches;
  if (kind.starts_with("samples"))
    return static_cast<Check>(static_cast<unsigned>(Check::pixels) | static_cast<unsigned>(Check::samples));
  if (kind.starts_with("estimate")) return Check::estimate;
  if (kind.starts_with("without")) return Check::all;
  return Check::pixels;
}

Report examine(const api::JobRequest& job, std::uint64_t seed, Check checks) {
  const auto has = [&](Check check) { return (static_cast<unsigned>(checks) & static_cast<unsigned>(check)) != 0; };
  Report report;
  Renderer renderer(job);
  const Values rgb = renderer({}).film->rgb;
  check_finite(job, rgb, report);
  if (has(Check::structures)) check_structures(job, renderer, rgb, report);
  if (has(Check::switches)) check_switches(job, renderer, rgb, report);
  Report of_pixels;
  if (has(Check::pixels)) check_pixels(job, renderer, seed, checks, of_pixels);
  if (has(Check::estimate)) check_estimate(job, renderer, seed, of_pixels);
  report.pixels = of_pixels.pixels, report.ambiguous = of_pixels.ambiguous, report.sigma = of_pixels.sigma;
  report.findings.insert(report.findings.end(), of_pixels.findings.begin(), of_pixels.findings.end());
  return report;
}

}  // namespace penumbra::hunt
