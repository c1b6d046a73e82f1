#include "tests/bench/contract_image.h"

#include <stdexcept>

namespace penumbra::bench {
namespace {

/// A point light is a spot that shines everywhere.
scene::SpotLight as_spot(const scene::Light& light) {
  if (const auto* spot = std::get_if<scene::SpotLight>(&light)) {
    scene::SpotLight result = *spot;
    result.direction = math::normalize(spot->direction);
    return result;
  }
  const auto* point = std::get_if<scene::PointLight>(&light);
  if (!point) throw std::invalid_argument("a light that is neither point nor spot");
  return {point->position, point->intensity, point->attenuation, point->radius, {0, 0, 1}, 0, 180};
}

}  // namespace

std::vector<scene::SpotLight> merged_lights(const scene::Description& description) {
  std::vector<scene::SpotLight> merged;
  for (const scene::Light& light : description.lights) {
    const scene::SpotLight spot = as_spot(light);
    const auto twin = std::find_if(merged.begin(), merged.end(), [&](scene::SpotLight other) {
      other.intensity = spot.intensity;
      return other == spot;
    });
    if (twin == merged.end()) {
      merged.push_back(spot);
    } else {
      twin->intensity += spot.intensity;
    }
  }
  return merged;
}

PinholeCamera::PinholeCamera(const scene::Camera& camera, int width, int height) : position_(camera.position) {
  const Vec3 forward = math::normalize(camera.direction);
  const Vec3 right = math::normalize(math::cross(forward, camera.up));
  const Vec3 up = math::cross(right, forward);
  scene::ViewPlane plane;
  if (camera.view_plane) {
    plane = *camera.view_plane;
  } else {
    plane.height = 2 * std::tan(camera.vertical_fov_degrees.value() * (M_PI / 360));
    plane.width = plane.height * width / height;
  }
  step_right_ = right * (plane.width / width);
  step_down_ = up * (-plane.height / height);
  corner_ = forward * plane.distance - right * (plane.width / 2) + up * (plane.height / 2);
}

Vec3 PinholeCamera::direction(int column, int row) const {
  return math::normalize(corner_ + step_right_ * (column + 0.5) + step_down_ * (row + 0.5));
}

}  // namespace penumbra::bench
