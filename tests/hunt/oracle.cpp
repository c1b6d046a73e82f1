#include "tests/hunt/oracle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "engine/math/constants.h"
#include "tests/hunt/optics.h"

namespace penumbra::hunt {
namespace {

constexpr double side_in_doubt = 1e-7;

void mix(std::uint64_t& signature, std::uint64_t value) {
  signature = (signature ^ value) * 0x9E3779B97F4A7C15 + (signature >> 29);
}

Color product(const Color& a, const Color& b, const Color& c) { return a * b * c; }

}  // namespace

struct Oracle::Path {
  int depth = 0;
  Color weight = math::white;
};

/// A ray's nearest crossing.
struct Meeting {
  Vec3 position, view, facing, shading, outward;
  const scene::Material* material = nullptr;
};

Oracle::Oracle(const scene::Description& scene, const scene::Options& options)
    : scene_(scene), options_(options), frame_(scene), bodies_(scene, frame_) {
  // The scene's own numbers are rounded where it lies.
  const double place = math::max_component(math::abs(scene.camera.position)) * frame_.scale;
  touch_ = std::max(1e-6, place * 0x1p-52 * 256);
}

bool Oracle::is_integrated() const {
  return options_.samples_per_pixel > 1 || (scene_.camera.lens && scene_.camera.lens->aperture_radius > 0);
}

Oracle::Ray Oracle::camera_ray(double x, double y, double lens_x, double lens_y) const {
  const scene::Camera& camera = scene_.camera;
  const double aspect = static_cast<double>(options_.width) / options_.height;
  scene::ViewPlane plane;
  if (camera.view_plane) {
    plane = *camera.view_plane;
  } else {
    plane.height = 2 * std::tan(*camera.vertical_fov_degrees * pi / 360);
    plane.width = plane.height * aspect;
  }
  const Vec3 ahead = math::normalize(camera.direction), right = math::normalize(math::cross(ahead, camera.up)),
             up = math::cross(right, ahead);
  const Vec3 across =
      right * ((x / options_.width - 0.5) * plane.width) + up * ((0.5 - y / options_.height) * plane.height);
  const bool is_flat = camera.projection == scene::Projection::orthographic;
  Vec3 origin = is_flat ? across * frame_.scale : Vec3{};
  Vec3 direction = is_flat ? ahead : ahead * plane.distance + across;
  if (camera.lens) {
    const Vec3 shift = (right * lens_x + up * lens_y) * (camera.lens->aperture_radius * frame_.scale);
    direction = direction * (camera.lens->focus_distance * frame_.scale / math::dot(direction, ahead)) - shift;
    origin += shift;
  }
  return {origin, math::normalize(direction)};
}

Gathered Oracle::gather(double x, double y, double lens_x, double lens_y) const {
  Gathered out;
  follow(camera_ray(x, y, lens_x, lens_y), {}, out);
  return out;
}

void Oracle::follow(const Ray& ray, const Path& path, Gathered& out) const {
  const double nothing = path.depth == 0 ? 0 : touch_;
  found_.clear();
  for (std::size_t i = 0; i < bodies_.size(); ++i) bodies_.meet(i, ray.origin, ray.direction, found_);
  double nearest = math::infinity;
  for (const Crossing& c : found_) {
    if (c.t > nothing) nearest = std::min(nearest, c.t);
  }
  if (nearest == math::infinity) {
    mix(out.signature, 1);
    out.constant += path.weight * scene_.background;
    return;
  }
  // Of those that coincide an opaque one, else the first in the scene.
  std::optional<Crossing> met;
  const auto transmits = [&](const Crossing& c) { return !math::is_black(bodies_.material(c.body).transmission); };
  for (const Crossing& c : found_) {
    if (c.t < nearest || c.t <= nothing || c.t > nearest + touch_ * std::max(1.0, nearest / 16)) continue;
    if (!met || (transmits(*met) && !transmits(c))) met = c;
  }
  const Normals normals = bodies_.normals_at(*met, ray.origin, ray.direction);
  Meeting at{ray.origin + ray.direction * met->t, ray.direction, normals.geometric, normals.shading, normals.geometric,
             &bodies_.material(met->body)};
  if (math::dot(at.facing, ray.direction) > 0) at.facing = -at.facing;
  mix(out.signature, 2 + 2 * static_cast<std::uint64_t>(at.material - scene_.materials.data()) +
                         (math::dot(at.outward, ray.direction) > 0 ? 1 : 0));
  out.trail.push_back(met->t);
  out.constant += path.weight * at.material->emission;
  if (path.depth == 0) out.constant += product(path.weight, scene_.ambient, at.material->ambient);
  light(path, at, out);
  if (path.depth == options_.max_depth) return;

  const scene::Material& m = *at.material;
  Color reflection = m.reflection;
  std::optional<Vec3> through;
  if (!math::is_black(m.transmission)) {
    through =
        m.ior == 1 ? at.view : refracted(at.view, at.shading, math::dot(at.view, at.outward) < 0 ? 1 / m.ior : m.ior);
    if (!through) reflection = reflection + m.transmission;
    mix(out.signature, through ? 3 : 5);
  }
  const auto go = [&](const Color& factor, const Vec3& direction) {
    const Color weight = path.weight * factor;
    const double most = math::max_channel(weight);
    if (most == 0) return;
    if (std::fabs(most - options_.min_contribution) < 1e-9 * most) out.is_on_edge = true;
    if (most < options_.min_contribution) return;
    follow({at.position, direction}, {path.depth + 1, weight}, out);
  };
  go(reflection, mirrored(at.view, at.shading));
  if (through) go(m.transmission, *through);
}

void Oracle::light(const Path& path, const Meeting& at, Gathered& out) const {
  if (math::is_black(at.material->diffuse) && math::is_black(at.material->specular)) return;
  for (const scene::Light& light : scene_.lights) {
    if (std::holds_alternative<scene::RectangleLight>(light) || std::holds_alternative<scene::SphereLight>(light)) {
      out.terms.push_back({&light, path.weight, at.position, at.facing, at.view, at.shading, at.material, {}, 0});
    } else {
      hard_or_disc(path, at, light, out);
    }
  }
}

void Oracle::hard_or_disc(const Path& path, const Meeting& at, const scene::Light& light, Gathered& out) const {
  Vec3 towards;
  Color intensity;
  double radius = 0, strength = 1;
  const auto* sun = std::get_if<scene::DirectionalLight>(&light);
  const auto take = [&](const auto& lamp) {
    towards = frame_.point(lamp.position) - at.position;
    intensity = lamp.intensity;
    radius = lamp.radius * frame_.scale;
    const double d = math::length(towards) / frame_.scale;
    strength = 1 / (lamp.attenuation.constant + lamp.attenuation.linear * d + lamp.attenuation.quadratic * d * d);
  };
  if (sun != nullptr) {
    towards = -math::normalize(sun->direction);
    intensity = sun->intensity;
    radius = std::tan(sun->angular_radius_degrees * pi / 180);
  } else if (const auto* point = std::get_if<scene::PointLight>(&light)) {
    take(*point);
  } else if (const auto* spot = std::get_if<scene::SpotLight>(&light)) {
    take(*spot);
    const double cosine = -math::dot(math::normalize(spot->direction), math::normalize(towards));
    const double limit = std::cos(spot->cutoff_degrees * pi / 180);
    mix(out.signature, cosine < limit ? 7 : 9);
    if (std::fabs(cosine - limit) < 1e-12) out.is_on_edge = true;
    strength = cosine < limit ? 0 : strength * std::pow(std::max(0.0, cosine), spot->exponent);
  }
  const Vec3 l = -math::normalize(towards);
  const Color share = product(path.weight, intensity * strength, lobe(*at.material, l, at.view, at.shading));
  if (math::is_black(share)) return;
  const double height = -math::dot(at.facing, l);
  if (std::fabs(height) < side_in_doubt) out.is_on_edge = true;
  mix(out.signature, height > 0 ? 11 : 13);
  if (height <= 0) return;
  if (radius > 0) {
    out.terms.push_back({&light, share, at.position, at.facing, at.view, at.shading, at.material, towards, radius});
  } else {
    out.constant += share * transmittance(at.position, at.facing, at.material->transmission, towards, sun != nullptr,
                                          &out.signature);
  }
}

Color Oracle::transmittance(const Vec3& from, const Vec3& facing, const Color& own, const Vec3& way, bool is_endless,
                            std::uint64_t* signature) const {
  Color result = math::white;
  const double length = math::length(way);
  const double first = touch_ / length, last = is_endless ? math::infinity : 1 - first;
  // What leaves to the far side of its own surface crosses that.
  if (math::dot(way, facing) < 0) result = own;
  std::uint64_t crossed = 0;
  for (std::size_t i = 0; i < bodies_.size() && (signature != nullptr || !math::is_black(result)); ++i) {
    found_.clear();
    bodies_.meet(i, from, way, found_);
    for (const Crossing& c : found_) {
      if (c.t <= first || c.t >= last) continue;
      const scene::Material& material = bodies_.material(i);
      result = result * material.transmission;
      if (signature != nullptr)
        crossed += 0x9E3779B97F4A7C15 * (static_cast<std::uint64_t>(&material - scene_.materials.data()) + 17);
    }
  }
  // One that nothing opaque may hide twice over.
  if (signature != nullptr) mix(*signature, math::is_black(result) ? 15 : 17 + crossed);
  return result;
}

Color Oracle::sample(const Term& term, double u, double v, Color& open) const {
  if (const auto* rectangle = std::get_if<scene::RectangleLight>(term.light))
    return rectangle_sample(term, *rectangle, u, v, open);
  if (const auto* sphere = std::get_if<scene::SphereLight>(term.light)) return sphere_sample(term, *sphere, u, v, open);
  const bool is_endless = std::holds_alternative<scene::DirectionalLight>(*term.light);
  const Axes axes(math::normalize(term.towards));
  const double r = term.radius * std::sqrt(u), angle = 2 * pi * v;
  const Vec3 way = term.towards + axes.u * (r * std::cos(angle)) + axes.v * (r * std::sin(angle));
  open = term.weight;
  return term.weight * transmittance(term.from, term.facing, term.material->transmission, way, is_endless, nullptr);
}

/// `weight`: radiance over π and density. The light must be on the viewer's side.
Color Oracle::area_sample(const Term& term, const Vec3& way, double weight, Color& open) const {
  if (math::dot(way, term.facing) <= 0) return math::black;
  const Vec3 l = -math::normalize(way);
  const Color value = term.weight * lobe(*term.material, l, term.view, term.shading) * (weight / pi);
  open += value;
  if (math::is_black(value)) return value;
  return value * transmittance(term.from, term.facing, term.material->transmission, way, false, nullptr);
}

/// One place of the rectangle and one direction of the hemisphere, each weighed by the density of both together
/// (Veach's balance heuristic): neither a far light nor one at arm's length makes it noisy.
Color Oracle::rectangle_sample(const Term& term, const scene::RectangleLight& light, double u, double v,
                               Color& open) const {
  const Vec3 corner = frame_.point(light.corner) - term.from, eu = light.edge_u * frame_.scale,
             ev = light.edge_v * frame_.scale;
  const Vec3 across = math::cross(eu, ev), normal = math::normalize(across);
  const double height = -math::dot(corner, normal), area = math::length(across);
  open = {};
  if (height <= touch_) return {};
  const auto weighed = [&](const Vec3& way) {
    const double distance = math::length(way), cosine = height / distance;
    const double by_area = distance * distance / (area * cosine),
                 by_cosine = std::max(0.0, math::dot(way, term.facing)) / (distance * pi);
    return area_sample(term, way, 1 / (by_area + by_cosine), open);
  };
  Color sum = weighed(corner + eu * u + ev * v);
  const Axes axes(term.facing);
  const double r = std::sqrt(u), angle = 2 * pi * v;
  const Vec3 w = axes.u * (r * std::cos(angle)) + axes.v * (r * std::sin(angle)) + term.facing * std::sqrt(1 - u);
  const double slope = -math::dot(w, normal);
  if (slope > 0) {
    const Vec3 way = w * (height / slope), inside = way - corner;
    const double scale = 1 / math::dot(across, across);
    const double a = math::dot(math::cross(inside, ev), across) * scale,
                 b = math::dot(math::cross(eu, inside), across) * scale;
    if (a >= 0 && a <= 1 && b >= 0 && b <= 1) sum += weighed(way);
  }
  open = open * light.radiance;
  return sum * light.radiance;
}

Color Oracle::sphere_sample(const Term& term, const scene::SphereLight& light, double u, double v, Color& open) const {
  const Vec3 middle = frame_.point(light.center) - term.from;
  const double radius = light.radius * frame_.scale, distance = math::length(middle);
  open = {};
  bool is_inside = distance < radius - touch_;
  if (!is_inside && distance < radius + touch_) {
    if (math::dot(middle, term.facing) <= 0) return {};
    is_inside = true;
  }
  const double lowest = is_inside ? -1 : std::sqrt((distance - radius) * (distance + radius)) / distance;
  // 1 − cosine, in which small lights lose no digits.
  const double narrow = is_inside ? 2 : (radius / distance) * (radius / distance) / (1 + lowest);
  const double missing = u * narrow, cosine = 1 - missing, sine = std::sqrt(std::max(0.0, missing * (2 - missing))),
               angle = 2 * pi * v;
  const Axes axes(is_inside && distance == 0 ? Vec3{0, 0, 1} : middle * (1 / distance));
  const Vec3 w = axes.w * cosine + axes.u * (sine * std::cos(angle)) + axes.v * (sine * std::sin(angle));
  const double b = math::dot(middle, w);
  const Vec3 off = middle - w * b;
  const double half = std::sqrt(std::max(0.0, radius * radius - math::dot(off, off)));
  const double reach = is_inside ? b + half : b - half;
  if (reach <= 0) return {};
  const Color value = area_sample(term, w * reach, 2 * pi * narrow, open) * light.radiance;
  open = open * light.radiance;
  return value;
}

}  // namespace penumbra::hunt
