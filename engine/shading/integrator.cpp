#include "engine/shading/integrator.h"

#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"
#include "engine/sampling/directions.h"
#include "engine/shading/irradiance.h"
#include "engine/shading/phong.h"

namespace penumbra::shading {
namespace {

using math::dot;

// Places inside a path's key.
constexpr std::uint64_t reflected_path = 1, transmitted_path = 2, first_light = 16;

/// Somebody who cancels waits as long as these take, beside a single ray.
constexpr std::size_t lights_between_looks = 16;

/// The product, where 0 × anything is 0 – an overflowing light on a black surface stays black.
Color filtered(const Color& a, const Color& b) {
  const auto product = [](double x, double y) { return x == 0 || y == 0 ? 0 : x * y; };
  return {product(a.r, b.r), product(a.g, b.g), product(a.b, b.b)};
}

/// Light arriving from direction l reaches the viewer only when both are on one side of the surface.
bool is_on_viewers_side(const ShadingPoint& at, const Vec3& towards_light) { return dot(at.facing, towards_light) > 0; }

/// What the surface sends to the viewer of light that travels along the unit `l`.
Color lobe_towards(const ShadingPoint& at, const Vec3& l) {
  return is_on_viewers_side(at, -l) ? phong(at, l) : math::black;
}

/// Above the geometric horizon and on one side of the shading one.
bool is_wholly_above(const ShadingPoint& at, const std::array<Vec3, 4>& corners) {
  const Vec3& n = at.surface.shading_normal;
  const bool is_up = dot(n, corners[0]) > 0;
  return std::all_of(corners.begin(), corners.end(), [&](const Vec3& corner) {
    return is_on_viewers_side(at, corner) && (dot(n, corner) > 0) == is_up;
  });
}

/// What is diffusely sent of light that nothing hides, in closed form.
Color diffuse_of(const ShadingPoint& at, const Color& radiance, double projected_solid_angle) {
  return filtered(radiance, at.material->diffuse * (projected_solid_angle / math::pi));
}

/// Snell's refraction of the unit `v` at the unit normal `n` (facing v), `ratio` = ior outside / inside. Nothing under
/// total internal reflection.
std::optional<Vec3> refracted(const Vec3& v, const Vec3& n, double ratio) {
  const double cosine = -dot(v, n);
  const double sine_squared = ratio * ratio * std::max(0.0, 1 - cosine * cosine);
  if (sine_squared >= 1) return std::nullopt;
  return math::normalize((v + n * cosine) * ratio - n * std::sqrt(1 - sine_squared));
}

}  // namespace

Integrator::Integrator(const Scene& scene, const IntegratorSettings& settings, const std::function<bool()>& is_canceled)
    : scene_(scene),
      settings_(settings),
      is_canceled_(is_canceled),
      shadows_(scene, settings_.switches, counters_, is_canceled) {}

Integrator::Sample Integrator::trace(const geometry::Ray& ray, const DiscSampling& sampling, const sampling::Key& key) {
  return trace(ray, accel::closest_hit(scene_.world, ray), sampling, key);
}

void Integrator::camera_hits(std::span<const geometry::PreparedRay> rays, std::optional<accel::Hit>* hits) {
  accel::closest_hits(scene_.world, rays, {}, hits);
  if (scene_.world.structure.wide) counters_.camera_rays_bundled += rays.size() - 1;
}

Integrator::Sample Integrator::trace(const geometry::Ray& ray, const std::optional<accel::Hit>& hit,
                                     const DiscSampling& sampling, const sampling::Key& key) {
  sampling_ = &sampling;
  variance_ = {};
  ++counters_.camera;
  const Color value = radiance(ray, hit, {}, key);
  return {value, variance_};
}

Color Integrator::radiance(const geometry::Ray& ray, const std::optional<accel::Hit>& hit, const Path& path,
                           const sampling::Key& key) {
  if (is_canceled_()) return math::black;
  if (!hit) return scene_.background;
  ShadingPoint at;
  at.surface = accel::surface_at(scene_.world, ray, *hit);
  at.id = hit->surface;
  at.material = &scene_.materials[scene_.item_material[hit->surface.item]];
  at.view = ray.direction;
  at.facing = dot(at.surface.normal, ray.direction) > 0 ? -at.surface.normal : at.surface.normal;
  const Path here{path.depth, path.distance + hit->t, path.weight};
  at.footprint = settings_.pixel_width.at_camera + settings_.pixel_width.per_distance * here.distance;

  Color result = at.material->emission;
  if (path.depth == 0) result += scene_.ambient * at.material->ambient;
  if (at.material->is_lit) result += direct(at, path.weight, key);
  if (path.depth < settings_.max_depth) result += secondary(at, here, key);
  return result;
}

Color Integrator::direct(const ShadingPoint& at, const Color& weight, const sampling::Key& key) {
  Color sum;
  for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
    if ((i + 1) % lights_between_looks == 0 && is_canceled_()) return math::black;
    sum += std::visit(
        [&](const auto& light) {
          return lit_by(light, at, weight, {i, {key, first_light + i}});
        },
        scene_.lights[i]);
  }
  return sum;
}

bool Integrator::is_skipped(bool adds_nothing, std::uint64_t& counter) {
  counter += adds_nothing ? 1 : 0;
  return adds_nothing && settings_.switches.lights_without_share;
}

Color Integrator::visible(const Color& share, const Visibility& visibility, const Color& weight) {
  if (visibility.is_certain) return filtered(share, visibility.mean);
  const Color scale = filtered(filtered(share, weight), filtered(share, weight));
  variance_.measured += filtered(scale, visibility.variance.measured);
  variance_.modelled += filtered(scale, visibility.variance.modelled);
  return filtered(share, visibility.mean);
}

Color Integrator::lit_by(const DiscLight& light, const ShadingPoint& at, const Color& weight, const LightPlace& place) {
  const Vec3 towards = light.position - at.surface.position;
  if (is_skipped(!is_on_viewers_side(at, towards), counters_.lights_facing_away)) return math::black;
  const double distance = math::length(towards);
  const Vec3 l = towards * (-1 / distance);
  double strength = 1;
  if (light.is_spot) {
    const double cosine = dot(light.direction, l);
    strength = cosine < light.cutoff_cosine ? 0 : math::power(std::clamp(cosine, 0.0, 1.0), light.exponent);
  }
  const Color lobe = lobe_towards(at, l) * strength;
  if (is_skipped(math::is_black(lobe), counters_.lights_without_effect)) return math::black;
  const double divisor = light.attenuation.constant + light.attenuation.linear * distance +
                         light.attenuation.quadratic * distance * distance;
  const Color share = filtered(light.intensity * (1 / std::max(divisor, 1e-300)), lobe);
  if (is_skipped(math::is_black(share), counters_.lights_without_effect)) return math::black;
  shadows_.aim(at, place.index, {light.position, light.radius}, light.radius > 0);
  if (light.radius == 0) return filtered(share, shadows_.transmittance(at, towards, 1));
  return visible(share, shadows_.disc(at, {towards, l, light.radius}, *sampling_, place.samples), weight);
}

Color Integrator::lit_by(const DistantLight& light, const ShadingPoint& at, const Color& weight,
                         const LightPlace& place) {
  const Vec3 towards = -light.direction;
  if (is_skipped(!is_on_viewers_side(at, towards), counters_.lights_facing_away)) return math::black;
  const Color share = filtered(light.intensity, lobe_towards(at, light.direction));
  if (is_skipped(math::is_black(share), counters_.lights_without_effect)) return math::black;
  shadows_.aim(at, place.index, {towards, light.tangent, true}, light.tangent > 0);
  if (light.tangent == 0) return filtered(share, shadows_.transmittance(at, towards, HUGE_VAL));
  const SeenDisc disc{towards, towards, light.tangent, true};
  return visible(share, shadows_.disc(at, disc, *sampling_, place.samples), weight);
}

template <class SampleFunction, class ExactDiffuse>
Color Integrator::averaged_area_light(const SampleFunction& sample, const Color& weight, bool is_lit,
                                      const ExactDiffuse& exact_diffuse) {
  const auto count = static_cast<std::uint32_t>(sampling_->spiral.count());
  struct Sums {
    sampling::Halves halves;  // of a (0, 2)-sequence: the first and the last samples
    Color of_squares, unshadowed;
  } whole, highlights;
  bool is_open = true;
  for (std::uint32_t i = 0; i < count; ++i) {
    if ((i + 1) % samples_between_looks == 0 && is_canceled_()) return math::black;
    const AreaSample light = sample(i);
    is_open = is_open && light.transmittance == math::white;
    const auto add = [&](const Color& unshadowed, Sums& sums) {
      const Color value = filtered(unshadowed, light.transmittance);
      sums.halves.add(2 * i >= count, value);
      sums.of_squares += value * value;
      sums.unshadowed += unshadowed;
    };
    add(light.diffuse + light.highlight, whole);
    add(light.highlight, highlights);
  }
  // Where no sample is hidden the closed form is nearer to the truth – and whether that is certain beforehand depends
  // on how the scene is searched, which the picture must not.
  const std::optional<Color> exact = is_open ? exact_diffuse() : std::nullopt;
  const Sums& used = exact ? highlights : whole;
  const double n = count;
  const Color mean = used.halves.mean();
  // That n samples agree does not mean that all would: as for discs, half a sample more may be shadowed or not.
  const double share = 0.5 / (n + 1);
  const Color& at_stake = exact && is_lit ? highlights.unshadowed : whole.unshadowed;
  const Color unknown = at_stake * at_stake * (share * (1 - share) / (n * n));
  const Color found = used.of_squares * (1 / n) - mean * mean;
  const Color spread{std::max(found.r, unknown.r), std::max(found.g, unknown.g), std::max(found.b, unknown.b)};
  // As for discs: well-spread samples beat independent ones by √N in variance.
  const Color squared = filtered(weight, weight);
  const double scale = spread_variance / (n * std::sqrt(n));
  variance_.measured += filtered(squared, used.halves.variance(sampling::Halves::points));
  variance_.modelled += filtered(
      squared, {std::max(0.0, spread.r) * scale, std::max(0.0, spread.g) * scale, std::max(0.0, spread.b) * scale});
  return exact.value_or(math::black) + mean;
}

Color Integrator::lit_by(const RectangleLight& light, const ShadingPoint& at, const Color& weight,
                         const LightPlace& place) {
  const Vec3 corner = light.corner - at.surface.position;
  const double height = -dot(light.normal, corner);
  const Vec3 sizes = math::abs(light.corner) + math::abs(at.surface.position);
  // What lies in the light's own plane, but for rounding, is not in front of it.
  if (!(height > dot(math::abs(light.normal), at.surface.error + sizes * math::gamma(32))))
    return ++counters_.lights_facing_away, math::black;
  const std::array<Vec3, 4> corners{corner, corner + light.edge_u, corner + light.edge_u + light.edge_v,
                                    corner + light.edge_v};
  if (std::none_of(corners.begin(), corners.end(), [&](const Vec3& c) { return is_on_viewers_side(at, c); }))
    return ++counters_.lights_facing_away, math::black;

  const Vec3 diagonal = (light.edge_u + light.edge_v) * 0.5;
  const double half_width =
      std::max(math::length(diagonal), math::length(light.edge_u - light.edge_v) * 0.5) * (1 + math::gamma(64));
  shadows_.aim(at, place.index, {light.corner + diagonal, half_width}, false);
  const Shadows::Verdict verdict = shadows_.classify(at, corners);
  if (verdict == Shadows::Verdict::dark) return skip_samples(counters_.shadow_rays_dark), math::black;
  const auto exact_diffuse = [&]() -> std::optional<Color> {
    if (!settings_.switches.exact_area_lights || !is_wholly_above(at, corners)) return std::nullopt;
    return diffuse_of(at, light.radiance, projected_solid_angle(corners, at.surface.shading_normal));
  };
  const bool is_lit = verdict == Shadows::Verdict::lit;
  if (is_lit && math::is_black(at.material->specular)) {
    if (const auto exact = exact_diffuse()) return skip_samples(counters_.area_samples_exact), *exact;
  }
  // A skewed one is sampled by the right-angled one around it from close by, where places of equal area weigh whatever
  // they like.
  const bool is_near = dot(corner + diagonal, corner + diagonal) < 4 * half_width * half_width;
  const auto seen = light.is_right_angled || is_near
                        ? sampling::SphericalRectangle::seen_from(at.surface.position, light.around.corner,
                                                                  light.around.edge_u, light.around.edge_v)
                        : std::nullopt;
  const bool may_be_beside = seen && !light.is_right_angled;
  const auto is_beside = [&](const Vec3& towards) {
    const Vec3 inside = towards - corner, &across = light.around.edge_v;
    const double v = dot(inside, across) / dot(across, across);
    const double u = dot(inside - light.edge_v * v, light.edge_u) / dot(light.edge_u, light.edge_u);
    return u < 0 || u > 1 || v < 0 || v > 1;
  };
  // The light often lies in a surface of the scene (a lamp in a ceiling), whose triangles may be far larger: its
  // samples sit that much in front of it.
  const double rounding = math::gamma(32) * (dot(math::abs(light.normal), sizes) + scene_.extent);
  const Vec3 lift = light.normal * std::min(rounding, 0x1p-20 * height);
  const sampling::Key key = place.samples.key();
  const auto sample = [&](std::uint32_t i) -> AreaSample {
    const sampling::Point2 square = sampling::sobol_owen(i, key);
    const Vec3 towards = seen ? seen->point(square) : corner + light.edge_u * square.x + light.edge_v * square.y;
    if (!is_on_viewers_side(at, towards) || (may_be_beside && is_beside(towards))) return {};
    const double distance = math::length(towards);
    const double measure = seen ? seen->solid_angle() : light.area * height / (distance * distance * distance);
    return lit_sample(at, light.radiance * (measure / math::pi), towards * (1 / distance), towards + lift, verdict);
  };
  return averaged_area_light(sample, weight, is_lit, exact_diffuse);
}

Color Integrator::lit_by(const SphereLight& light, const ShadingPoint& at, const Color& weight,
                         const LightPlace& place) {
  const Vec3 axis = light.center - at.surface.position;
  // The light is often shown by a sphere of the same radius, whose outside it does not light, whatever the rounding;
  // its samples sit that much in front of it.
  const double lifted = math::gamma(32) * dot(math::abs(light.center) + math::abs(at.surface.position), {1, 1, 1}) +
                        0x1p-40 * light.radius;
  if (!(dot(at.facing, axis) > lifted - light.radius)) return ++counters_.lights_facing_away, math::black;
  const auto cone = sampling::cone_of_sphere(at.surface.position, light.center, light.radius);
  shadows_.aim(at, place.index, {light.center, light.radius}, false);
  Shadows::Verdict verdict = Shadows::Verdict::unknown;
  const std::uint32_t ignored = settings_.switches.exact_area_lights ? light.lamp : accel::no_item;
  if (cone) {
    // All samples lie in the tangent cone, between the plane that touches the sphere and the one of the tangent circle.
    const double d = cone->distance, r = cone->radius;
    const double slope = r / std::sqrt((d - r) * (d + r)) * (1 + math::gamma(64));
    const auto classify_up_to = [&](double depth) {
      const Vec3 middle = cone->frame.n * depth, u = cone->frame.u * (depth * slope),
                 v = cone->frame.v * (depth * slope);
      return shadows_.classify(at, {middle - u - v, middle + u - v, middle + u + v, middle - u + v}, ignored);
    };
    verdict = classify_up_to((d - r) * (d + r) / d);
    // What hides the far plane may stand inside the light: only in front of the near plane does it hide every sample.
    if (verdict == Shadows::Verdict::dark && classify_up_to(d - r) != Shadows::Verdict::dark)
      verdict = Shadows::Verdict::unknown;
  }
  if (verdict == Shadows::Verdict::dark) return skip_samples(counters_.shadow_rays_dark), math::black;
  const auto exact_diffuse = [&]() -> std::optional<Color> {
    if (!settings_.switches.exact_area_lights || !(dot(at.facing, axis) > light.radius) ||
        !(std::fabs(dot(at.surface.shading_normal, axis)) > light.radius))
      return std::nullopt;
    return diffuse_of(at, light.radiance,
                      std::fabs(projected_solid_angle(axis, light.radius, at.surface.shading_normal)));
  };
  const bool is_lit = verdict == Shadows::Verdict::lit;
  if (is_lit && math::is_black(at.material->specular)) {
    if (const auto exact = exact_diffuse()) return skip_samples(counters_.area_samples_exact), *exact;
  }
  const sampling::Key key = place.samples.key();
  const auto sample = [&](std::uint32_t i) -> AreaSample {
    const sampling::Point2 square = sampling::sobol_owen(i, key);
    Vec3 towards;
    if (cone) {
      towards = point_in_cone(*cone, square);
    } else {
      const Vec3 w = sampling::direction_on_sphere(square);
      const double b = dot(axis, w);
      const double inside = light.radius * light.radius - dot(axis, axis);
      towards = w * (b + std::sqrt(std::max(0.0, b * b + inside)));
    }
    if (!is_on_viewers_side(at, towards)) return {};
    const double solid_angle = cone ? cone->solid_angle : 4 * math::pi;
    const double distance = math::length(towards), left = std::max(0.5, 1 - lifted / distance);
    return lit_sample(at, light.radiance * (solid_angle / math::pi), towards * (1 / distance), towards * left, verdict);
  };
  return averaged_area_light(sample, weight, is_lit, exact_diffuse);
}

Integrator::AreaSample Integrator::lit_sample(const ShadingPoint& at, const Color& radiance, const Vec3& direction,
                                              const Vec3& place, Shadows::Verdict verdict) {
  AreaSample sample{filtered(radiance, at.material->diffuse * std::fabs(dot(direction, at.surface.shading_normal))),
                    filtered(radiance, highlight(at, -direction))};
  if (!math::is_black(sample.diffuse + sample.highlight))
    sample.transmittance = shadows_.transmittance_of_sample(verdict, at, place, 1);
  return sample;
}

void Integrator::skip_samples(std::uint64_t& counter) const {
  counter += static_cast<std::uint64_t>(sampling_->spiral.count());
}

Color Integrator::secondary(const ShadingPoint& at, const Path& path, const sampling::Key& key) {
  const CompiledMaterial& material = *at.material;
  Color reflection = material.reflection, transmission = material.transmission;
  const Vec3 &n = at.surface.shading_normal, &v = at.view;
  std::optional<Vec3> through;
  if (material.transmits) {
    through = v;
    if (material.ior != 1) {
      const bool is_entering = dot(v, at.surface.normal) < 0;
      const Vec3 towards_viewer = dot(v, n) > 0 ? -n : n;
      through = refracted(v, towards_viewer, is_entering ? 1 / material.ior : material.ior);
      if (!through) reflection = reflection + transmission;
    }
  }
  Color result;
  const auto follow = [&](const Color& factor, const auto& towards, std::uint64_t which, std::uint64_t& counter) {
    if (math::is_black(factor)) return;
    const Color weight = path.weight * factor;
    if (math::max_channel(weight) < settings_.min_contribution) {
      ++counters_.negligible_rays;
      return;
    }
    ++counter;
    const Vec3 direction = towards();
    const geometry::Ray ray{leave_surface(at.surface, direction), direction, at.id};
    result += filtered(factor, radiance(ray, accel::closest_hit(scene_.world, ray),
                                        {path.depth + 1, path.distance, weight}, key.at(which)));
  };
  const auto mirrored = [&] { return math::normalize(v - n * (2 * dot(v, n))); };
  follow(reflection, mirrored, reflected_path, counters_.reflection);
  if (through)
    follow(
        transmission, [&] { return *through; }, transmitted_path, counters_.transmission);
  return result;
}

}  // namespace penumbra::shading
