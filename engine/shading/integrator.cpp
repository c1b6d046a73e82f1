#include "engine/shading/integrator.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/shading/lights/light.h"

namespace penumbra::shading {
namespace {

using math::dot;

// Places inside a path's key.
constexpr std::uint64_t reflected_path = 1, transmitted_path = 2, first_light = 16;

/// Somebody who cancels waits as long as these take, beside a single ray.
constexpr std::size_t lights_between_looks = 16;

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
  sampling_ = &sampling;
  variance_ = {};
  ++counters_.rays.camera;
  const Color value = radiance(ray, accel::closest_hit(scene_.world, ray), {}, key);
  return {value, variance_};
}

void Integrator::camera_hits(std::span<const geometry::PreparedRay> rays, std::optional<accel::Hit>* hits) {
  static constexpr std::array<accel::SurfaceId, accel::bundle_width> nothing{};
  accel::closest_hits(scene_.world, {rays, nothing.data()}, hits);
  if (scene_.world.structure.wide) counters_.camera_rays_bundled += rays.size() - 1;
}

void Integrator::trace(std::span<const CameraRay> rays, const DiscSampling& sampling, Sample* samples) {
  sampling_ = &sampling;
  counters_.rays.camera += rays.size();
  PointBatch points;
  std::array<std::size_t, lane_count> lanes;
  std::array<sampling::Key, lane_count> keys = array_of<lane_count>([&](std::size_t) { return rays[0].key; });
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!rays[i].hit) continue;
    lanes[i] = points.add(point(rays[i].ray, *rays[i].hit, 0), rays[i].pixel);
    keys[lanes[i]] = rays[i].key;
  }
  BatchSums sums;
  const bool is_canceled = is_canceled_();
  if (!is_canceled && points.lit() != 0) light_together(points, keys.data(), sums);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    samples[i] = {rays[i].hit ? math::black : scene_.background, {}};
    if (!rays[i].hit || is_canceled) continue;
    const ShadingPoint& at = points.point(lanes[i]);
    const Path path{0, rays[i].hit->t, math::white};
    variance_ = sums.variance[lanes[i]];
    samples[i].radiance = unlit(at, path);
    if (at.material->is_lit) samples[i].radiance += sums.color[lanes[i]];
    if (settings_.max_depth > 0) samples[i].radiance += secondary(at, path, rays[i].key);
    samples[i].variance = variance_;
  }
}

Color Integrator::radiance(const geometry::Ray& ray, const std::optional<accel::Hit>& hit, const Path& path,
                           const sampling::Key& key) {
  if (is_canceled_()) return math::black;
  if (!hit) return scene_.background;
  const ShadingPoint at = point(ray, *hit, path.distance);
  const Path here{path.depth, path.distance + hit->t, path.weight};
  Color result = unlit(at, path);
  if (at.material->is_lit) result += direct(at, path.weight, key);
  if (path.depth < settings_.max_depth) result += secondary(at, here, key);
  return result;
}

ShadingPoint Integrator::point(const geometry::Ray& ray, const accel::Hit& hit, double distance) const {
  ShadingPoint at;
  at.surface = accel::surface_at(scene_.world, ray, hit);
  at.id = hit.surface;
  at.material = &scene_.materials[scene_.item_material[hit.surface.item]];
  at.view = ray.direction;
  at.facing = dot(at.surface.normal, ray.direction) > 0 ? -at.surface.normal : at.surface.normal;
  at.footprint = settings_.pixel_width.at_camera + settings_.pixel_width.per_distance * (distance + hit.t);
  return at;
}

Color Integrator::unlit(const ShadingPoint& at, const Path& path) const {
  Color result = at.material->emission;
  if (path.depth == 0) result += scene_.ambient * at.material->ambient;
  return result;
}

Color Integrator::direct(const ShadingPoint& at, const Color& weight, const sampling::Key& key) {
  const Lighting lighting{scene_, settings_.switches, *sampling_, is_canceled_, counters_, shadows_, at,
                          weight, variance_};
  Color sum;
  for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
    if ((i + 1) % lights_between_looks == 0 && is_canceled_()) return math::black;
    const LightPlace place{i, {key, first_light + i}};
    sum += std::visit([&](const auto& light) { return lit_by(light, lighting, place); }, scene_.lights[i]);
  }
  return sum;
}

void Integrator::light_together(const PointBatch& points, const sampling::Key* keys, BatchSums& sums) {
  const BatchLighting lighting{scene_, settings_.switches, *sampling_, is_canceled_, counters_, shadows_, points, keys,
                               sums};
  for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
    if ((i + 1) % lights_between_looks == 0 && is_canceled_()) return;
    std::visit([&](const auto& light) { light_batch(light, lighting, {i, first_light + i}); }, scene_.lights[i]);
  }
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
  follow(reflection, mirrored, reflected_path, counters_.rays.reflection);
  if (through)
    follow(
        transmission, [&] { return *through; }, transmitted_path, counters_.rays.transmission);
  return result;
}

}  // namespace penumbra::shading
