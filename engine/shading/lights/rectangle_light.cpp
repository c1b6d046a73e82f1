#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"
#include "engine/math/error_free.h"
#include "engine/sampling/directions.h"
#include "engine/shading/irradiance.h"
#include "engine/shading/lights/area_light.h"

namespace penumbra::shading {
namespace {

using math::dot;
using shadows::Sight;

/// A rectangle light as a point sees it.
struct SeenRectangle {
  const RectangleLight& light;
  const ShadingPoint& at;
  Vec3 corner;    // relative to the point
  Vec3 sizes;     // of the coordinates that take part
  double height;  // of the point above the light's plane

  SeenRectangle(const RectangleLight& l, const ShadingPoint& p)
      : light(l),
        at(p),
        corner(l.corner - p.surface.position),
        sizes(math::abs(l.corner) + math::abs(p.surface.position)),
        height(-dot(l.normal, corner)) {}

  std::array<Vec3, 4> corners() const {
    return {corner, corner + light.edge_u, corner + light.edge_u + light.edge_v, corner + light.edge_v};
  }
  /// What lies in the light's own plane, but for rounding, is not in front of it.
  bool is_in_front() const { return height > dot(math::abs(light.normal), at.surface.error + sizes * math::gamma(32)); }
  /// No part of it is far nearer than others: then lines across it are worth as much as directions.
  bool is_small() const {
    const double half = 0.5 * math::length(light.edge_u) + 0.5 * math::length(light.edge_v);
    return half < std::max(height, math::length(corner + (light.edge_u + light.edge_v) * 0.5) - half);
  }
  /// What lies before the ball around the light lies before its plane, in a cell's hull with it: where that is seen
  /// from well in front, and the cell, of some 18 pixels' radius, is not a third as wide as the light is far.
  bool has_cells() const {
    const double distance = math::length(corner + (light.edge_u + light.edge_v) * 0.5);
    return height > 0.8 * distance && 55 * at.footprint < distance;
  }
  /// The light often lies in a surface of the scene (a lamp in a ceiling), whose triangles may be far larger: its
  /// samples sit that much in front of it.
  Vec3 lift(double extent) const {
    const double rounding = math::gamma(32) * (dot(math::abs(light.normal), sizes) + extent);
    return light.normal * std::min(rounding, 0x1p-20 * height);
  }
};

/// Its projected solid angle above the horizon, if that has enough digits.
std::optional<double> projected(const SeenRectangle& seen) {
  // Rounding moves the sum by some 1e-16: what is smaller than this has better digits when sampled.
  constexpr double smallest = 1e-8;
  const double integral = projected_solid_angle(seen.corners(), seen.at.facing, seen.at.surface.shading_normal);
  return integral > smallest ? std::optional(integral) : std::nullopt;
}

bool has_effect(const SeenRectangle& seen, const std::array<Vec3, 4>& corners) {
  return seen.is_in_front() &&
         std::ranges::any_of(corners, [&](const Vec3& c) { return is_on_viewers_side(seen.at, c); });
}

/// Adds up the light's samples.
Color sampled(const SeenRectangle& seen, const Lighting& lighting, const LightPlace& place, Sight& sight,
              Sight::Verdict verdict, const std::function<std::optional<Color>()>& exact_diffuse) {
  const RectangleLight& light = seen.light;
  const ShadingPoint& at = seen.at;
  const sampling::SeenParallelogram parallelogram(seen.corner, light.edge_u, light.edge_v, light.normal);
  const Vec3 lift = seen.lift(lighting.scene.extent);
  const sampling::Key key = place.samples.key();
  const auto sample = [&](std::uint32_t i) -> AreaSample {
    const auto [towards, solid_angle] = parallelogram.sample(sampling::sobol_owen(i, key));
    if (!is_on_viewers_side(at, towards)) return {};
    return lit_sample(at, sight, verdict, light.radiance * (solid_angle / math::pi),
                      towards * (1 / math::length(towards)), towards + lift);
  };
  return averaged(lighting, key.sample(), sample, exact_diffuse);
}

}  // namespace

Color lit_by(const RectangleLight& light, const Lighting& lighting, const LightPlace& place) {
  const ShadingPoint& at = lighting.at;
  const SeenRectangle seen(light, at);
  const std::array<Vec3, 4> corners = seen.corners();
  if (!has_effect(seen, corners)) return lighting.skip_if(true, &Counters::lights_facing_away), math::black;

  const auto exact = [&]() -> std::optional<Color> {
    const auto integral = lighting.switches.exact_area_lights ? projected(seen) : std::nullopt;
    return integral ? std::optional(diffuse_of(at, light.radiance, *integral)) : std::nullopt;
  };
  const Vec3 u = light.edge_u * 0.5, v = light.edge_v * 0.5, lift = seen.lift(lighting.scene.extent);
  // Around the ellipse around the light.
  const double reach = std::sqrt(2 * (dot(u, u) + dot(v, v))) * (1 + math::gamma(64));
  Sight sight = lighting.shadows.aim(at, place.index, {light.corner + u + v, reach, false, reach},
                                     seen.is_small() && seen.has_cells());
  if (const auto diffuse = seen.is_small() ? exact() : std::nullopt) {
    const shadows::SeenArea area{seen.corner + u + v + lift, u, v};
    if (const auto sum =
            traced(lighting, sight, area, {*diffuse, light.radiance, solid_angle(corners)}, place.samples.key()))
      return *sum;
  }
  const Sight::Verdict verdict = sight.classify(corners);
  if (verdict == Sight::Verdict::dark) return lighting.skip_samples(&Counters::shadow_rays_dark), math::black;
  if (verdict == Sight::Verdict::lit && math::is_black(at.material->specular)) {
    if (const auto diffuse = exact()) return lighting.skip_samples(&Counters::area_samples_exact), *diffuse;
  }
  return sampled(seen, lighting, place, sight, verdict, exact);
}

void light_batch(const RectangleLight& light, const BatchLighting& lighting, const LightName& name) {
  if (!FewSamples::are_switched_on(lighting.switches)) return light_each(light, lighting, name, lighting.points.lit());
  FewSamples few(lighting, name, light.radiance);
  const double radius = 0.5 * std::sqrt(dot(light.edge_u, light.edge_u) + dot(light.edge_v, light.edge_v));
  LaneMask others = 0;
  for_each_lane(lighting.points.lit(), [&](std::size_t lane) {
    const SeenRectangle seen(light, lighting.points.point(lane));
    const std::array<Vec3, 4> corners = seen.corners();
    const bool is_few = FewSamples::are_enough(lighting.sampling, radius,
                                               math::length(seen.corner + (light.edge_u + light.edge_v) * 0.5));
    const auto integral = is_few && has_effect(seen, corners) ? projected(seen) : std::nullopt;
    if (!integral) {
      others |= LaneMask{1} << lane;
      return;
    }
    const sampling::SeenParallelogram parallelogram(seen.corner, light.edge_u, light.edge_v, light.normal);
    const Vec3 lift = seen.lift(lighting.scene.extent);
    const bool is_above =
        std::ranges::all_of(corners, [&](const Vec3& corner) { return dot(seen.at.facing, corner) > 0; });
    few.add(lane, *integral, is_above, [&](const sampling::Point2& square) -> AreaPlace {
      const auto [towards, solid_angle] = parallelogram.sample(square);
      return {towards * (1 / math::length(towards)), towards + lift, solid_angle};
    });
  });
  few.add_visible();
  light_each(light, lighting, name, others);
}

}  // namespace penumbra::shading
