#include "engine/shading/integrator.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/shading/lights/light.h"

namespace penumbra::shading {
namespace {

using math::dot;

// Places inside a path's key.
constexpr std::uint64_t reflected_path = 1, transmitted_path = 2, light_choice = 3, first_light = 16;

/// Somebody who cancels waits as long as these take, beside a single ray.
constexpr std::size_t lights_between_looks = 16;

/// How far off a sum is of values drawn from parts side by side, with what each is off by itself: as the values of
/// every other part and the next differ.
class Pairs {
 public:
  void add(const Color& value) {
    if (is_second_) squares_ += (value - first_) * (value - first_);
    first_ = value, is_second_ = !is_second_;
  }
  double error() const { return std::sqrt(math::max_channel(squares_)); }

 private:
  Color first_, squares_;
  bool is_second_ = false;
};

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
  variance_ = {}, light_error_ = 0;
  ++counters_.rays.camera;
  const Color value =
      radiance(ray, accel::closest_hit(scene_.world, ray), {0, 0, math::white, settings_.light_error}, key);
  return {value, variance_, light_error_};
}

unsigned Integrator::meet(const accel::Bundle& rays, accel::Hit* hits, geometry::SurfacePoint* surfaces) {
  unsigned met = 0;
  if (settings_.switches.camera_bundles) {
    met = accel::closest_hits(scene_.world, rays, hits);
    accel::surfaces_at(scene_.world, rays, met, hits, surfaces);
    if (scene_.world.structure.wide) counters_.camera_rays_bundled += rays.size() - 1;
    return met;
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const geometry::Ray ray{rays.origin(i), rays.direction(i), {}};
    const std::optional<accel::Hit> hit = accel::closest_hit(scene_.world, ray);
    if (!hit) continue;
    hits[i] = *hit, surfaces[i] = accel::surface_at(scene_.world, ray, *hit), met |= 1u << i;
  }
  return met;
}

void Integrator::trace(std::span<const CameraRay> rays, const DiscSampling& sampling, Sample* samples) {
  constexpr std::size_t width = accel::bundle_width;
  sampling_ = &sampling;
  counters_.rays.camera += rays.size();
  PointBatch points;
  std::array<std::size_t, lane_count> lanes;
  std::array<double, lane_count> distances;
  std::array<sampling::Key, lane_count> keys = array_of<lane_count>([&](std::size_t) { return rays[0].key; });
  unsigned met = 0;
  accel::Bundle bundle;
  std::array<accel::Hit, width> hits;
  std::array<geometry::SurfacePoint, width> surfaces;
  for (std::size_t first = 0; first < rays.size(); first += width) {
    bundle.clear();
    for (const CameraRay& camera : rays.subspan(first, std::min(width, rays.size() - first)))
      bundle.add(camera.ray.origin, camera.ray.direction);
    const unsigned now = meet(bundle, hits.data(), surfaces.data());
    met |= now << first;
    for_each_lane(now, [&](std::size_t i) {
      const CameraRay& camera = rays[first + i];
      const std::size_t lane = points.add(point(camera.ray.direction, hits[i], surfaces[i], 0), camera.pixel);
      lanes[first + i] = lane, distances[first + i] = hits[i].t, keys[lane] = camera.key;
    });
  }
  points.fill_unused();
  BatchSums sums;
  const bool is_canceled = is_canceled_();
  if (!is_canceled && points.lit() != 0) light_together(points, keys.data(), sums);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const bool has_met = (met >> i & 1u) != 0;
    samples[i] = {has_met ? math::black : scene_.background, {}};
    if (!has_met || is_canceled) continue;
    const ShadingPoint& at = points.point(lanes[i]);
    const Path path{0, distances[i], math::white, settings_.light_error};
    variance_ = sums.variance[lanes[i]], light_error_ = sums.light_error[lanes[i]];
    samples[i].radiance = unlit(at, path);
    if (at.material->is_lit) samples[i].radiance += sums.color[lanes[i]];
    if (settings_.max_depth > 0) samples[i].radiance += secondary(at, path, rays[i].key);
    samples[i].variance = variance_, samples[i].light_error = light_error_;
  }
}

Color Integrator::radiance(const geometry::Ray& ray, const std::optional<accel::Hit>& hit, const Path& path,
                           const sampling::Key& key) {
  if (is_canceled_()) return math::black;
  if (!hit) return scene_.background;
  const ShadingPoint at = point(ray.direction, *hit, accel::surface_at(scene_.world, ray, *hit), path.distance);
  const Path here{path.depth, path.distance + hit->t, path.weight, path.light_error};
  Color result = unlit(at, path);
  if (at.material->is_lit) result += direct(at, path, key);
  if (path.depth < settings_.max_depth) result += secondary(at, here, key);
  return result;
}

ShadingPoint Integrator::point(const Vec3& direction, const accel::Hit& hit, const geometry::SurfacePoint& surface,
                               double distance) const {
  const Vec3& normal = surface.normal;
  return {surface,
          hit.surface,
          &scene_.materials[scene_.item_material[hit.surface.item]],
          direction,
          dot(normal, direction) > 0 ? -normal : normal,
          settings_.pixel_width.at_camera + settings_.pixel_width.per_distance * (distance + hit.t)};
}

Color Integrator::unlit(const ShadingPoint& at, const Path& path) const {
  Color result = at.material->emission;
  if (path.depth == 0) result += scene_.ambient * at.material->ambient;
  return result;
}

double Integrator::own_error(const CompiledMaterial& material, const Path& path) const {
  const bool goes_on = path.depth < settings_.max_depth && (material.reflects || material.transmits);
  return goes_on ? path.light_error / 2 : path.light_error;
}

template <class Region>
void Integrator::choose_lights(const Region& region, std::size_t points, double error, const sampling::Key& key) {
  if (!scene_.light_tree || !settings_.switches.light_tree) return lights_.take_all(scene_.lights.size());
  lights_.take(*scene_.light_tree, region(), settings_.switches.drawn_lights ? error : 0, key.at(light_choice));
  counters_.lights_culled += points * lights_.culled();
  counters_.lights_from_drawn += points * lights_.unseen();
}

template <class Use>
bool Integrator::each_light(const Use& use) {
  std::size_t looked_at = 0;
  bool goes_on = true;
  lights_.for_each([&](std::size_t light) {
    goes_on = ++looked_at % lights_between_looks != 0 || !is_canceled_();
    if (goes_on) std::visit([&](const auto& kind) { use(kind, light); }, scene_.lights[light]);
    return goes_on;
  });
  return goes_on;
}

template <class Use>
bool Integrator::each_drawn_light(const Use& use) {
  std::size_t looked_at = 0;
  for (const auto& [light, times] : lights_.drawn()) {
    if (++looked_at % lights_between_looks == 0 && is_canceled_()) return false;
    std::visit([&, index = light, scale = times](const auto& kind) { use(kind, index, scale); }, scene_.lights[light]);
  }
  return true;
}

Color Integrator::direct(const ShadingPoint& at, const Path& path, const sampling::Key& key) {
  const auto region = [&] {
    LitRegion around;
    around.add(at, path.weight);
    return around;
  };
  choose_lights(region, 1, own_error(*at.material, path), key);
  const auto lighting = [&](Variance& variance) {
    return Lighting{scene_, settings_.switches, *sampling_, is_canceled_, counters_, shadows_,
                    at,     path.weight,        variance};
  };
  const Lighting of_each = lighting(variance_);
  Color sum;
  bool is_whole = each_light([&](const auto& light, std::size_t i) {
    sum += lit_by(light, of_each, {i, {key, first_light + i}});
  });
  Variance unused;
  const Lighting of_drawn = lighting(unused);
  Pairs pairs;
  is_whole = is_whole && each_drawn_light([&](const auto& light, std::size_t i, double times) {
               const Color more = lit_by(light, of_drawn, {i, {key, first_light + i}}) * times;
               sum += more, pairs.add(filtered(path.weight, more));
             });
  light_error_ += pairs.error();
  return is_whole ? sum : math::black;
}

void Integrator::light_together(const PointBatch& points, const sampling::Key* keys, BatchSums& sums) {
  const Path from_camera{0, 0, math::white, settings_.light_error};
  double error = settings_.light_error;
  for_each_lane(points.lit(), [&](std::size_t lane) {
    error = std::min(error, own_error(*points.point(lane).material, from_camera));
  });
  const auto region = [&] {
    LitRegion around;
    for_each_lane(points.lit(), [&](std::size_t lane) { around.add(points.point(lane), math::white); });
    return around;
  };
  choose_lights(region, static_cast<std::size_t>(std::popcount(points.lit())), error,
                keys[std::countr_zero(points.lit())]);
  const auto lighting = [&](BatchSums& into) {
    return BatchLighting{scene_, settings_.switches, *sampling_, is_canceled_, counters_, shadows_, points, keys, into};
  };
  const BatchLighting of_each = lighting(sums);
  if (!each_light([&](const auto& light, std::size_t i) { light_batch(light, of_each, {i, first_light + i}); })) return;
  if (lights_.drawn().empty()) return;
  std::array<Pairs, lane_count> pairs;
  each_drawn_light([&](const auto& light, std::size_t i, double times) {
    BatchSums one;
    light_batch(light, lighting(one), {i, first_light + i});
    for_each_lane(points.lit(), [&](std::size_t lane) {
      sums.color[lane] += one.color[lane] * times, pairs[lane].add(one.color[lane] * times);
    });
  });
  for_each_lane(points.lit(), [&](std::size_t lane) { sums.light_error[lane] = pairs[lane].error(); });
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
  const double light_error = path.light_error / (material.reflects && material.transmits ? 4 : 2);
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
                                        {path.depth + 1, path.distance, weight, light_error}, key.at(which)));
  };
  const auto mirrored = [&] { return math::normalize(v - n * (2 * dot(v, n))); };
  follow(reflection, mirrored, reflected_path, counters_.rays.reflection);
  if (through)
    follow(
        transmission, [&] { return *through; }, transmitted_path, counters_.rays.transmission);
  return result;
}

}  // namespace penumbra::shading
