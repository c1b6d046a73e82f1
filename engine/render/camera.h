#pragma once
#include <optional>

#include "engine/accel/half_spaces.h"
#include "engine/geometry/ray.h"
#include "engine/sampling/patterns.h"
#include "engine/scene/camera.h"
#include "engine/shading/integrator.h"

namespace penumbra::render {

/// Camera rays of a width × height image, as the contract (section 1) places them.
class Camera {
 public:
  Camera(const scene::Camera& camera, int width, int height);

  /// Through the image position (x, y) in pixels from the top left corner – the first pixel's center is (½, ½) – and
  /// the point `lens` of the unit disc. The direction is unit.
  geometry::Ray ray(double x, double y, const sampling::Point2& lens) const;
  /// Encloses every ray through the image positions in these ranges (pixels, as for `ray`); nothing where rays do not
  /// start from one point.
  std::optional<accel::HalfSpaces> pyramid(double left, double top, double right, double bottom) const;
  shading::PixelWidth pixel_width() const;
  bool has_lens() const { return aperture_radius_ > 0; }

 private:
  math::Vec3 position_, direction_, right_, up_;  // the last three orthonormal
  double plane_width_, plane_height_, plane_distance_;
  double image_width_, image_height_;  // pixels
  bool is_orthographic_;
  double aperture_radius_ = 0, focus_distance_ = 1;
};

}  // namespace penumbra::render
