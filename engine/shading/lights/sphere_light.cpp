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

/// What is known of all samples, which lie in the tangent cone, between the plane that touches the sphere and the one
/// of the tangent circle.
Sight::Verdict classify(const sampling::SphereCone& cone, Sight& sight, std::uint32_t ignored) {
  const double d = cone.distance, r = cone.radius;
  const double slope = r / std::sqrt((d - r) * (d + r)) * (1 + math::gamma(64));
  const auto classify_up_to = [&](double depth) {
    const Vec3 middle = cone.frame.n * depth, u = cone.frame.u * (depth * slope), v = cone.frame.v * (depth * slope);
    return sight.classify({middle - u - v, middle + u - v, middle + u + v, middle - u + v}, ignored);
  };
  const Sight::Verdict verdict = classify_up_to((d - r) * (d + r) / d);
  // What hides the far plane may stand inside the light: only in front of the near plane does it hide every sample.
  if (verdict == Sight::Verdict::dark && classify_up_to(d - r) != Sight::Verdict::dark) return Sight::Verdict::unknown;
  return verdict;
}

/// Where the sphere is met in the direction that `square` chooses, by a point that sees its center at `axis`.
sampling::SeenPlace place_on(const SphereLight& light, const std::optional<sampling::SphereCone>& cone,
                             const Vec3& axis, const sampling::Point2& square) {
  if (cone) return point_in_cone(*cone, square);
  const Vec3 w = sampling::direction_on_sphere(square);
  const double b = dot(axis, w), distance = math::length(axis);
  const double inside = (light.radius - distance) * (light.radius + distance);
  return {w, b + std::sqrt(std::max(0.0, b * b + inside))};
}

/// ∫ |n·ω| dω over what a point sees of a sphere around `axis` above its horizon, if there is a closed form.
std::optional<double> projected(const ShadingPoint& at, const Vec3& axis, double radius) {
  const Vec3& n = at.surface.shading_normal;
  const double distance = math::length(axis), height = dot(at.facing, axis);
  if (!(distance > radius)) return math::pi;  // everything above the horizon
  if (height > radius && std::fabs(dot(n, axis)) > radius) return projected_solid_angle(axis, radius, n);
  const bool is_flat = n == at.facing || n == -at.facing;
  constexpr double farthest = 1e4;  // in radii, that leaves enough digits
  if (!is_flat || height > radius || distance > farthest * radius) return std::nullopt;
  return projected_solid_angle_above(axis, radius, at.facing);
}

}  // namespace

Color lit_by(const SphereLight& light, const Lighting& lighting, const LightPlace& place) {
  const ShadingPoint& at = lighting.at;
  const Vec3 axis = light.center - at.surface.position;
  // The light is often shown by a sphere of the same radius, whose outside it does not light, whatever the rounding;
  // its samples sit that much in front of it.
  const double lifted = math::gamma(32) * dot(math::abs(light.center) + math::abs(at.surface.position), {1, 1, 1}) +
                        0x1p-40 * light.radius;
  if (!(dot(at.facing, axis) > lifted - light.radius))
    return lighting.skip_if(true, &Counters::lights_facing_away), math::black;
  const auto cone = sampling::cone_of_sphere(at.surface.position, light.center, light.radius);
  Sight sight = lighting.shadows.aim(at, place.index, {light.center, light.radius});
  const std::uint32_t ignored = lighting.switches.exact_area_lights ? light.lamp : accel::no_item;
  const Sight::Verdict verdict = cone ? classify(*cone, sight, ignored) : Sight::Verdict::unknown;
  if (verdict == Sight::Verdict::dark) return lighting.skip_samples(&Counters::shadow_rays_dark), math::black;
  const auto exact_diffuse = [&]() -> std::optional<Color> {
    const auto integral = lighting.switches.exact_area_lights ? projected(at, axis, light.radius) : std::nullopt;
    return integral ? std::optional(diffuse_of(at, light.radiance, *integral)) : std::nullopt;
  };
  if (verdict == Sight::Verdict::lit && math::is_black(at.material->specular)) {
    if (const auto exact = exact_diffuse()) return lighting.skip_samples(&Counters::area_samples_exact), *exact;
  }
  const sampling::Key key = place.samples.key();
  const auto sample = [&](std::uint32_t i) -> AreaSample {
    const auto [direction, distance] = place_on(light, cone, axis, sampling::sobol_owen(i, key));
    if (!is_on_viewers_side(at, direction)) return {};
    const double solid_angle = cone ? cone->solid_angle : 4 * math::pi;
    const double left = std::max(0.5, 1 - lifted / distance);
    return lit_sample(at, sight, verdict, light.radiance * (solid_angle / math::pi), direction,
                      direction * (distance * left));
  };
  return averaged(lighting, key.sample(), sample, exact_diffuse);
}

}  // namespace penumbra::shading
