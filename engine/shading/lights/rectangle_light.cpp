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
  /// The light often lies in a surface of the scene (a lamp in a ceiling), whose triangles may be far larger: its
  /// samples sit that much in front of it.
  Vec3 lift(double extent) const {
    const double rounding = math::gamma(32) * (dot(math::abs(light.normal), sizes) + extent);
    return light.normal * std::min(rounding, 0x1p-20 * height);
  }
};

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
  if (!seen.is_in_front()) return lighting.skip_if(true, &Counters::lights_facing_away), math::black;
  const std::array<Vec3, 4> corners = seen.corners();
  if (std::none_of(corners.begin(), corners.end(), [&](const Vec3& c) { return is_on_viewers_side(at, c); }))
    return lighting.skip_if(true, &Counters::lights_facing_away), math::black;

  const Vec3 diagonal = (light.edge_u + light.edge_v) * 0.5;
  const double half_width =
      std::max(math::length(diagonal), math::length(light.edge_u - light.edge_v) * 0.5) * (1 + math::gamma(64));
  Sight sight = lighting.shadows.aim(at, place.index, {light.corner + diagonal, half_width});
  const Sight::Verdict verdict = sight.classify(corners);
  if (verdict == Sight::Verdict::dark) return lighting.skip_samples(&Counters::shadow_rays_dark), math::black;
  const auto exact_diffuse = [&]() -> std::optional<Color> {
    if (!lighting.switches.exact_area_lights) return std::nullopt;
    // Rounding moves the sum by some 1e-16: what is smaller than this has better digits when sampled.
    constexpr double smallest = 1e-8;
    const double integral = projected_solid_angle(corners, at.facing, at.surface.shading_normal);
    return integral > smallest ? std::optional(diffuse_of(at, light.radiance, integral)) : std::nullopt;
  };
  if (verdict == Sight::Verdict::lit && math::is_black(at.material->specular)) {
    if (const auto exact = exact_diffuse()) return lighting.skip_samples(&Counters::area_samples_exact), *exact;
  }
  return sampled(seen, lighting, place, sight, verdict, exact_diffuse);
}

}  // namespace penumbra::shading
