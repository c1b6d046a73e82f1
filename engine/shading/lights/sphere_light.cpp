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

/// A sphere light as a point sees it. The light is often shown by a sphere of the same radius, whose outside it does
/// not light, whatever the rounding; its samples sit that much in front of it.
struct SeenSphereLight {
  const SphereLight& light;
  const ShadingPoint& at;
  Vec3 axis;
  double lifted;
  std::optional<sampling::SphereCone> cone;

  SeenSphereLight(const SphereLight& l, const ShadingPoint& p)
      : light(l),
        at(p),
        axis(l.center - p.surface.position),
        lifted(math::gamma(32) * math::taxicab(math::abs(l.center) + math::abs(p.surface.position)) +
               0x1p-40 * l.radius),
        cone(sampling::cone_of_sphere(p.surface.position, l.center, l.radius)) {}
  bool has_effect() const { return dot(at.facing, axis) > lifted - light.radius; }
  bool is_above_horizon() const { return cone && dot(at.facing, axis) > light.radius * (1 + math::gamma(64)); }
  std::optional<Color> exact_diffuse() const {
    const auto integral = projected(at, axis, light.radius);
    return integral ? std::optional(diffuse_of(at, light.radiance, *integral)) : std::nullopt;
  }
  /// Lines across the disc that shows it are worth as much as directions.
  bool is_small() const { return cone && light.radius < 0.7 * cone->distance; }
  /// The disc of the circle where the cone touches it: seen from here, all of the light.
  shadows::SeenArea area(std::uint32_t ignored) const {
    const double squared = (cone->distance - cone->radius) * (cone->distance + cone->radius);
    const double depth = squared / cone->distance, radius = depth * cone->radius / std::sqrt(squared);
    return {cone->frame.n * depth, cone->frame.u * radius, cone->frame.v * radius, true, axis, light.radius, ignored};
  }
  AreaPlace place(const sampling::Point2& square) const {
    const auto [direction, distance] = place_on(light, cone, axis, square);
    const double left = std::max(0.5, 1 - lifted / distance);
    return {direction, direction * (distance * left), cone ? cone->solid_angle : 4 * math::pi};
  }
};

}  // namespace

Color lit_by(const SphereLight& light, const Lighting& lighting, const LightPlace& place) {
  const ShadingPoint& at = lighting.at;
  const SeenSphereLight seen(light, at);
  if (!seen.has_effect()) return lighting.skip_if(true, &Counters::lights_facing_away), math::black;
  const bool is_exact = lighting.switches.exact_area_lights;
  const auto exact_diffuse = [&] { return is_exact ? seen.exact_diffuse() : std::nullopt; };
  Sight sight = lighting.shadows.aim(at, place.index, {light.center, light.radius, false, light.radius},
                                     light.stands_free && seen.is_small());
  const std::uint32_t ignored = is_exact ? light.lamp : accel::no_item;
  if (const auto diffuse = light.stands_free && seen.is_small() ? exact_diffuse() : std::nullopt) {
    const shadows::SeenArea area = seen.area(ignored);
    if (const auto sum =
            traced(lighting, sight, area, {*diffuse, light.radiance, seen.cone->solid_angle}, place.samples.key()))
      return *sum;
  }
  const Sight::Verdict verdict = seen.cone ? classify(*seen.cone, sight, ignored) : Sight::Verdict::unknown;
  if (verdict == Sight::Verdict::dark) return lighting.skip_samples(&Counters::shadow_rays_dark), math::black;
  if (verdict == Sight::Verdict::lit && math::is_black(at.material->specular)) {
    if (const auto diffuse = exact_diffuse()) return lighting.skip_samples(&Counters::area_samples_exact), *diffuse;
  }
  const sampling::Key key = place.samples.key();
  const auto sample = [&](std::uint32_t i) -> AreaSample {
    const auto [direction, way, solid_angle] = seen.place(sampling::sobol_owen(i, key));
    if (!is_on_viewers_side(at, direction)) return {};
    return lit_sample(at, sight, verdict, light.radiance * (solid_angle / math::pi), direction, way);
  };
  return averaged(lighting, key.sample(), sample, exact_diffuse);
}

void light_batch(const SphereLight& light, const BatchLighting& lighting, const LightName& name) {
  if (!FewSamples::are_switched_on(lighting.switches)) return light_each(light, lighting, name, lighting.points.lit());
  FewSamples few(lighting, name, light.radiance);
  LaneMask others = 0;
  for_each_lane(lighting.points.lit(), [&](std::size_t lane) {
    const SeenSphereLight seen(light, lighting.points.point(lane));
    const bool is_few = FewSamples::are_enough(lighting.sampling, light.radius, math::length(seen.axis));
    const auto integral =
        is_few && seen.has_effect() && seen.cone ? projected(seen.at, seen.axis, light.radius) : std::nullopt;
    if (integral && *integral > 0) {
      few.add(lane, *integral, seen.is_above_horizon(),
              [&](const sampling::Point2& square) { return seen.place(square); });
    } else {
      others |= LaneMask{1} << lane;
    }
  });
  few.add_visible();
  light_each(light, lighting, name, others);
}

}  // namespace penumbra::shading
