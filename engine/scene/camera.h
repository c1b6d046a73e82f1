#pragma once
#include <optional>

#include "engine/math/vec3.h"

namespace penumbra::scene {

enum class Projection { perspective, orthographic };

/// The rectangle the image shows, `distance` ahead of the camera; `width` and `height` in scene units.
struct ViewPlane {
  double width = 1, height = 1, distance = 1;
};

/// Thin lens: points at `focus_distance` along the view direction are sharp.
struct Lens {
  double aperture_radius = 0, focus_distance = 1;
};

/// `direction` is what was written, or look_at − position; `direction` and `up` need not be unit and are not parallel.
/// Exactly one of `view_plane` and `vertical_fov_degrees` is set.
struct Camera {
  math::Vec3 position, direction{0, 0, -1}, up{0, 1, 0};
  std::optional<ViewPlane> view_plane;
  std::optional<double> vertical_fov_degrees;
  Projection projection = Projection::perspective;
  std::optional<Lens> lens;
};

}  // namespace penumbra::scene
