#pragma once
#include <variant>

#include "engine/math/color.h"
#include "engine/math/vec3.h"

namespace penumbra::scene {

/// Divisor c + l·d + q·d² at distance d; all ≥ 0, not all 0.
struct Attenuation {
  double constant = 1, linear = 0, quadratic = 0;
  bool operator==(const Attenuation&) const = default;
};

/// Soft when `radius` > 0: seen as the disc of that radius facing the lit point.
struct PointLight {
  math::Vec3 position;
  math::Color intensity;
  Attenuation attenuation;
  double radius = 0;
  bool operator==(const PointLight&) const = default;
};

/// A point light times max(0, direction·l)^exponent, and 0 outside the cutoff.
struct SpotLight {
  math::Vec3 position;
  math::Color intensity;
  Attenuation attenuation;
  double radius = 0;
  math::Vec3 direction;
  double exponent = 1;
  double cutoff_degrees = 90;
  bool operator==(const SpotLight&) const = default;
};

/// `direction` is the way the light travels.
struct DirectionalLight {
  math::Vec3 direction;
  math::Color intensity;
  double angular_radius_degrees = 0;
  bool operator==(const DirectionalLight&) const = default;
};

/// One-sided along edge_u × edge_v; `radiance` is the emitted radiance.
struct RectangleLight {
  math::Vec3 corner, edge_u, edge_v;
  math::Color radiance;
  bool operator==(const RectangleLight&) const = default;
};

struct SphereLight {
  math::Vec3 center;
  double radius = 1;
  math::Color radiance;
  bool operator==(const SphereLight&) const = default;
};

/// What a light is to a lit point: a point, with hard shadows; a disc that faces it; or an area of its own.
enum class Form { point, disc, area };
inline Form form_of(const PointLight& light) { return light.radius > 0 ? Form::disc : Form::point; }
inline Form form_of(const SpotLight& light) { return light.radius > 0 ? Form::disc : Form::point; }
inline Form form_of(const DirectionalLight& light) {
  return light.angular_radius_degrees > 0 ? Form::disc : Form::point;
}
inline Form form_of(const RectangleLight&) { return Form::area; }
inline Form form_of(const SphereLight&) { return Form::area; }

using Light = std::variant<PointLight, SpotLight, DirectionalLight, RectangleLight, SphereLight>;

}  // namespace penumbra::scene
