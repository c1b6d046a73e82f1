#include "api/parse_lights.h"

#include <variant>

#include "api/values.h"

namespace penumbra::api {

namespace {

std::optional<scene::Attenuation> read_attenuation(const Field& field) {
  const auto values = read_three(field, not_negative);
  if (!values) return std::nullopt;
  const auto& [constant, linear, quadratic] = *values;
  if (constant == 0 && linear == 0 && quadratic == 0) {
    field.fail("must not be all 0");
    return std::nullopt;
  }
  return scene::Attenuation{constant, linear, quadratic};
}

math::Color read_intensity(Members& light) { return light.required("intensity", read_any_color).value_or(math::black); }

math::Vec3 read_required_direction(Members& light) {
  return light.required("direction", read_direction).value_or(math::Vec3{0, 0, -1});
}

/// What point and spot lights have in common.
template <class PointLike>
PointLike read_point_like(Members& members) {
  PointLike light;
  light.position = members.required("position", read_point).value_or(light.position);
  light.intensity = read_intensity(members);
  light.attenuation = members.optional("attenuation", read_attenuation, light.attenuation);
  light.radius = members.optional("radius", number_in(length_or_zero), light.radius);
  return light;
}

scene::Light read_point_light(Members& members) { return read_point_like<scene::PointLight>(members); }

scene::Light read_spot_light(Members& members) {
  auto light = read_point_like<scene::SpotLight>(members);
  light.direction = read_required_direction(members);
  constexpr Range exponents{0, 1e9};
  constexpr Range cutoffs{0, 180, true};
  light.exponent = members.optional("exponent", number_in(exponents), light.exponent);
  light.cutoff_degrees = members.optional("cutoff", number_in(cutoffs), light.cutoff_degrees);
  return light;
}

scene::Light read_directional_light(Members& members) {
  scene::DirectionalLight light;
  light.direction = read_required_direction(members);
  light.intensity = read_intensity(members);
  constexpr Range angular_radii{0, 90, false, true};
  light.angular_radius_degrees =
      members.optional("angular_radius", number_in(angular_radii), light.angular_radius_degrees);
  return light;
}

scene::Light read_rectangle_light(Members& members) {
  scene::RectangleLight light;
  light.corner = members.required("corner", read_point).value_or(light.corner);
  const auto edge_u = members.required("edge_u", read_edge), edge_v = members.required("edge_v", read_edge);
  light.radiance = read_intensity(members);
  constexpr double smallest_sine = 1e-9;
  if (edge_u && edge_v && sine_between(*edge_u, *edge_v) < smallest_sine) {
    members.object().fail_at("edge_v", "must not be parallel to edge_u");
  }
  light.edge_u = edge_u.value_or(light.edge_u);
  light.edge_v = edge_v.value_or(light.edge_v);
  return light;
}

scene::Light read_sphere_light(Members& members) {
  scene::SphereLight light;
  light.center = members.required("center", read_point).value_or(light.center);
  light.radius = members.required("radius", number_in(any_length)).value_or(light.radius);
  light.radiance = read_intensity(members);
  return light;
}

using LightReader = scene::Light (*)(Members&);
constexpr std::array light_readers{std::pair{std::string_view("point"), LightReader{read_point_light}},
                                   std::pair{std::string_view("spot"), LightReader{read_spot_light}},
                                   std::pair{std::string_view("directional"), LightReader{read_directional_light}},
                                   std::pair{std::string_view("rectangle"), LightReader{read_rectangle_light}},
                                   std::pair{std::string_view("sphere"), LightReader{read_sphere_light}}};
static_assert(light_readers.size() == std::variant_size_v<scene::Light>, "a kind of light has no reader");

}  // namespace

std::vector<scene::Light> read_lights(const Field& field) {
  std::vector<scene::Light> lights;
  for_each_element(field, [&](const Field& element) {
    Members members(element);
    const std::optional<LightReader> read = members.required("type", one_of(light_readers));
    if (!read) return;
    lights.push_back((*read)(members));
    members.refuse_unknown();
  });
  return lights;
}

}  // namespace penumbra::api
