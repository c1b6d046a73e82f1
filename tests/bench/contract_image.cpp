#include "tests/bench/contract_image.h"

#include <cmath>

namespace penumbra::bench {

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
