#include "tests/accuracy/oracle.h"

#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "engine/math/constants.h"

namespace penumbra::test {
namespace {

using V = std::array<double, 3>;
constexpr double tau = 6.283185307179586;
constexpr double lift = 1e-7;  // of the scene's coordinates, which are in the hundreds

V of(const math::Vec3& a) { return {a.x, a.y, a.z}; }
V of(const math::Color& a) { return {a.r, a.g, a.b}; }
V add(V a, V b, double s = 1) { return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]}; }
V sub(V a, V b) { return add(a, b, -1); }
V scaled(V a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
V mul(V a, V b) { return {a[0] * b[0], a[1] * b[1], a[2] * b[2]}; }
double dot(V a, V b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
V cross(V a, V b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
V unit(V a) { return scaled(a, 1 / std::sqrt(dot(a, a))); }

/// Every t > 0 at which origin + t·direction meets the shape.
std::vector<double> meets(const scene::Shape& shape, V o, V d) {
  if (const auto* triangle = std::get_if<scene::Triangle>(&shape)) {
    const V a = of(triangle->vertices[0]), e = sub(of(triangle->vertices[1]), a), f = sub(of(triangle->vertices[2]), a);
    const V p = cross(d, f);
    const double determinant = dot(e, p);
    if (determinant == 0) return {};
    const V s = sub(o, a), q = cross(s, e);
    const double u = dot(s, p) / determinant, v = dot(d, q) / determinant, t = dot(f, q) / determinant;
    if (u < 0 || v < 0 || u + v > 1 || t <= 0) return {};
    return {t};
  }
  const auto& sphere = std::get<scene::Sphere>(shape);
  const V f = sub(o, of(sphere.center));
  const double a = dot(d, d), b = dot(f, d), c = dot(f, f) - sphere.radius * sphere.radius, root = b * b - a * c;
  if (root < 0) return {};
  std::vector<double> result;
  for (const double t : {(-b - std::sqrt(root)) / a, (-b + std::sqrt(root)) / a}) {
    if (t > 0) result.push_back(t);
  }
  return result;
}

V normal(const scene::Shape& shape, V p) {
  if (const auto* triangle = std::get_if<scene::Triangle>(&shape)) {
    const V a = of(triangle->vertices[0]);
    return unit(cross(sub(of(triangle->vertices[1]), a), sub(of(triangle->vertices[2]), a)));
  }
  return unit(sub(p, of(std::get<scene::Sphere>(shape).center)));
}

void flatten(const std::vector<scene::Object>& objects, std::vector<const scene::Object*>& out) {
  for (const scene::Object& object : objects) {
    if (const auto* group = std::get_if<scene::Group>(&object.shape)) {
      flatten(group->objects, out);
    } else {
      out.push_back(&object);
    }
  }
}

}  // namespace

struct Oracle::Impl {
  Oracle& oracle;
  const scene::Description& scene;
  std::vector<const scene::Object*> objects;

  explicit Impl(Oracle& o) : oracle(o), scene(o.scene_) { flatten(scene.objects, objects); }

  const scene::Material& material(const scene::Object& object) const {
    return scene.materials[static_cast<std::size_t>(object.material)];
  }

  V transmittance(V from, V towards, double limit) const {
    V product{1, 1, 1};
    for (const scene::Object* object : objects) {
      for (const double t : meets(object->shape, from, towards)) {
        if (t < limit) product = mul(product, of(material(*object).transmission));
      }
      if (product == V{0, 0, 0}) break;
    }
    return product;
  }

  /// Mean over a disc of `radius` around from + axis, facing the point.
  V visibility(V from, V axis, double radius, double limit) {
    if (radius == 0) return transmittance(from, axis, limit);
    const V w = unit(axis), u = unit(cross(std::fabs(w[0]) < 0.9 ? V{1, 0, 0} : V{0, 1, 0}, w)), v = cross(w, u);
    std::uniform_real_distribution<double> uniform;
    V sum{};
    for (int i = 0; i < oracle.samples_; ++i) {
      const double r = radius * std::sqrt(uniform(oracle.random_)), angle = tau * uniform(oracle.random_);
      sum = add(sum, transmittance(from, add(add(axis, u, r * std::cos(angle)), v, r * std::sin(angle)), limit));
    }
    return scaled(sum, 1.0 / oracle.samples_);
  }

  V lit(const scene::Material& m, V p, V n, V v) {
    V sum{};
    const V from = add(p, n, lift * 1000);
    for (const scene::Light& light : scene.lights) {
      V towards{}, intensity{};
      double radius = 0, limit = 1, strength = 1;
      if (const auto* sun = std::get_if<scene::DirectionalLight>(&light)) {
        towards = scaled(unit(of(sun->direction)), -1);
        intensity = of(sun->intensity);
        radius = std::tan(sun->angular_radius_degrees * tau / 360);
        limit = math::infinity;
      } else {
        const auto take = [&](const auto& lamp) {
          towards = sub(of(lamp.position), p);
          intensity = of(lamp.intensity);
          radius = lamp.radius;
          const double d = std::sqrt(dot(towards, towards));
          strength = 1 / (lamp.attenuation.constant + lamp.attenuation.linear * d + lamp.attenuation.quadratic * d * d);
        };
        if (const auto* point = std::get_if<scene::PointLight>(&light)) take(*point);
        if (const auto* spot = std::get_if<scene::SpotLight>(&light)) {
          take(*spot);
          const double cosine = -dot(unit(of(spot->direction)), unit(towards));
          strength *=
              cosine < std::cos(spot->cutoff_degrees * tau / 360) ? 0 : std::pow(std::max(0.0, cosine), spot->exponent);
        }
      }
      if (dot(n, towards) <= 0) continue;
      const V l = scaled(unit(towards), -1), r = sub(l, scaled(n, 2 * dot(l, n)));
      const V lobe = add(scaled(of(m.diffuse), std::fabs(dot(n, l))), of(m.specular),
                         std::pow(std::max(0.0, -dot(v, r)), m.shininess));
      const V share = mul(scaled(intensity, strength), lobe);
      if (share == V{0, 0, 0}) continue;
      sum = add(sum, mul(share, visibility(from, sub(add(p, towards), from), radius, limit)));
    }
    return sum;
  }

  V radiance(V o, V d, int depth, V weight) {
    const scene::Object* nearest = nullptr;
    double t = math::infinity;
    for (const scene::Object* object : objects) {
      for (const double at : meets(object->shape, o, d)) {
        if (at < t) t = at, nearest = object;
      }
    }
    if (nearest == nullptr) return of(scene.background);
    const V p = add(o, d, t);
    V n = normal(nearest->shape, p);
    if (dot(n, d) > 0) n = scaled(n, -1);
    const scene::Material& m = material(*nearest);
    V result = of(m.emission);
    if (depth == 0) result = add(result, mul(of(scene.ambient), of(m.ambient)));
    result = add(result, lit(m, p, n, d));
    if (depth == oracle.options_.max_depth) return result;
    const auto follow = [&](const math::Color& color, V direction, double side) {
      const V factor = of(color), next = mul(weight, factor);
      if (std::max({next[0], next[1], next[2]}) < std::max(oracle.options_.min_contribution, 1e-300)) return;
      result = add(result, mul(factor, radiance(add(p, n, side * lift * 1000), direction, depth + 1, next)));
    };
    follow(m.reflection, sub(d, scaled(n, 2 * dot(d, n))), 1);
    follow(m.transmission, d, -1);
    return result;
  }
};

Oracle::Oracle(const scene::Description& scene, const scene::Options& options, int samples_per_light,
               unsigned long seed)
    : scene_(scene), options_(options), samples_(samples_per_light), random_(seed) {}

std::array<double, 3> Oracle::pixel(int column, int row) {
  const scene::Camera& camera = scene_.camera;
  const V forward = unit(of(camera.direction)), right = unit(cross(forward, of(camera.up))), up = cross(right, forward);
  const scene::ViewPlane& plane = *camera.view_plane;
  const V through =
      add(add(scaled(forward, plane.distance), right, ((column + 0.5) / options_.width - 0.5) * plane.width), up,
          (0.5 - (row + 0.5) / options_.height) * plane.height);
  return Impl(*this).radiance(of(camera.position), unit(through), 0, {1, 1, 1});
}

}  // namespace penumbra::test
