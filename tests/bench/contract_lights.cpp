#include "tests/bench/contract_lights.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace penumbra::bench {
namespace {

void add(scene::SpotLight spot, ContractLights& lights) {
  spot.direction = math::normalize(spot.direction);
  const auto twin = std::ranges::find_if(lights.discs, [&](scene::SpotLight other) {
    other.intensity = spot.intensity;
    return other == spot;
  });
  if (twin == lights.discs.end()) {
    lights.discs.push_back(spot);
  } else {
    twin->intensity += spot.intensity;
  }
}
/// A point light is a spot that shines everywhere.
void add(const scene::PointLight& point, ContractLights& lights) {
  add(scene::SpotLight{point.position, point.intensity, point.attenuation, point.radius, {0, 0, 1}, 0, 180}, lights);
}
void add(const scene::RectangleLight& light, ContractLights& lights) {
  const double across = math::dot(light.edge_u, light.edge_v);
  if (std::fabs(across) > 1e-12 * math::length(light.edge_u) * math::length(light.edge_v))
    throw std::invalid_argument("a rectangle light that is none");
  lights.areas.push_back(light);
}
void add(const scene::SphereLight& light, ContractLights& lights) { lights.areas.push_back(light); }
void add(const scene::DirectionalLight&, ContractLights&) { throw std::invalid_argument("directional light"); }

}  // namespace

ContractLights lights_of(const scene::Description& description) {
  ContractLights lights;
  for (const scene::Light& light : description.lights) std::visit([&](const auto& l) { add(l, lights); }, light);
  const auto is_shiny = [](const scene::Material& material) { return !math::is_black(material.specular); };
  if (!lights.areas.empty() && std::ranges::any_of(description.materials, is_shiny))
    throw std::invalid_argument("an area light's highlight");
  return lights;
}

}  // namespace penumbra::bench
