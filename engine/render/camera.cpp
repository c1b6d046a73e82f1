#include "engine/render/camera.h"

#include <algorithm>

#include "engine/math/elementary.h"

namespace penumbra::render {

using math::Vec3;

Camera::Camera(const scene::Camera& camera, int width, int height)
    : position_(camera.position),
      direction_(math::normalize(camera.direction)),
      image_width_(width),
      image_height_(height),
      is_orthographic_(camera.projection == scene::Projection::orthographic) {
  right_ = math::normalize(math::cross(direction_, math::normalize(camera.up)));
  up_ = math::cross(right_, direction_);
  if (camera.view_plane) {
    plane_width_ = camera.view_plane->width;
    plane_height_ = camera.view_plane->height;
    plane_distance_ = camera.view_plane->distance;
  } else {
    const auto [sine, cosine] = math::sine_cosine_degrees(camera.vertical_fov_degrees.value_or(45) / 2);
    plane_distance_ = 1;
    plane_height_ = 2 * sine / cosine;
    plane_width_ = plane_height_ * image_width_ / image_height_;
  }
  if (camera.lens) aperture_radius_ = camera.lens->aperture_radius, focus_distance_ = camera.lens->focus_distance;
}

std::optional<accel::HalfSpaces> Camera::pyramid(double left, double top, double right, double bottom) const {
  if (is_orthographic_ || has_lens()) return std::nullopt;
  const auto towards = [&](double x, double y) { return ray(x, y, {0, 0}).direction; };
  return accel::pyramid(position_,
                        {towards(left, top), towards(right, top), towards(right, bottom), towards(left, bottom)}, true);
}

shading::PixelWidth Camera::pixel_width() const {
  const double width = std::max(plane_width_ / image_width_, plane_height_ / image_height_);
  return is_orthographic_ ? shading::PixelWidth{width, 0} : shading::PixelWidth{0, width / plane_distance_};
}

geometry::Ray Camera::ray(double x, double y, const sampling::Point2& lens) const {
  const Vec3 across =
      right_ * ((x / image_width_ - 0.5) * plane_width_) + up_ * ((0.5 - y / image_height_) * plane_height_);
  Vec3 origin = position_, direction = direction_ * plane_distance_ + across;
  if (is_orthographic_) origin = position_ + across, direction = direction_;
  if (has_lens()) {
    const Vec3 focus = direction * (focus_distance_ / math::dot(direction, direction_));
    const Vec3 shift = (right_ * lens.x + up_ * lens.y) * aperture_radius_;
    origin += shift;
    direction = focus - shift;
  }
  return {origin, math::normalize(direction), {}};
}

}  // namespace penumbra::render
