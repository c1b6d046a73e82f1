#include "api/parse_camera.h"

#include "api/values.h"

namespace penumbra::api {

namespace {

using math::Vec3;

/// From `position` to the point that `field` names.
std::optional<Vec3> read_target(const Field& field, const std::optional<Vec3>& position) {
  const std::optional<Vec3> point = read_point(field);
  if (!point || !position) return std::nullopt;
  const Vec3 direction = *point - *position;
  if (direction != Vec3{}) return direction;
  field.fail("must differ from position");
  return std::nullopt;
}

std::optional<Vec3> read_view_direction(Members& camera, const std::optional<Vec3>& position) {
  const std::optional<Field> direction = camera.optional("direction"), target = camera.optional("look_at");
  if (camera.is_object() && direction.has_value() == target.has_value()) {
    camera.object().fail("needs exactly one of direction and look_at");
  }
  const std::optional<Vec3> given = direction ? read_direction(*direction) : std::nullopt;
  const std::optional<Vec3> towards = target ? read_target(*target, position) : std::nullopt;
  if (direction && target) return std::nullopt;
  return direction ? given : towards;
}

/// `up` is checked against `direction` where that is known.
Vec3 read_up(Members& camera, const std::optional<Vec3>& direction) {
  const Vec3 up = camera.optional("up", read_direction, scene::Camera{}.up);
  constexpr double smallest_sine = 1e-9;
  if (direction && sine_between(*direction, up) < smallest_sine) {
    camera.object().fail_at("up", "must not be parallel to the view direction; its default is [0, 1, 0]");
  }
  return up;
}

std::optional<scene::ViewPlane> read_view_plane(const Field& field, bool is_distance_required) {
  Members members(field);
  scene::ViewPlane plane;
  plane.width = members.required("width", number_in(any_length)).value_or(plane.width);
  plane.height = members.required("height", number_in(any_length)).value_or(plane.height);
  if (is_distance_required) {
    plane.distance = members.required("distance", number_in(any_length)).value_or(plane.distance);
  } else {
    plane.distance = members.optional("distance", number_in(length_or_zero), plane.distance);
  }
  members.refuse_unknown();
  return plane;
}

std::optional<scene::Lens> read_lens(const Field& field) {
  Members members(field);
  scene::Lens lens;
  lens.aperture_radius = members.required("aperture_radius", number_in(length_or_zero)).value_or(lens.aperture_radius);
  lens.focus_distance = members.required("focus_distance", number_in(any_length)).value_or(lens.focus_distance);
  members.refuse_unknown();
  return lens;
}

/// Fills in the projection and what it projects onto.
scene::Camera read_projection(Members& members) {
  static constexpr std::array projections{std::pair{std::string_view("perspective"), scene::Projection::perspective},
                                          std::pair{std::string_view("orthographic"), scene::Projection::orthographic}};
  scene::Camera camera;
  const std::optional<Field> projection = members.optional("projection");
  const auto kind = projection ? one_of(projections)(*projection) : scene::Projection::perspective;
  camera.projection = kind.value_or(camera.projection);
  const bool is_orthographic = kind == scene::Projection::orthographic;

  const std::optional<Field> plane = members.optional("view_plane"), fov = members.optional("vertical_fov");
  if (is_orthographic) {
    if (fov) fov->fail("must be left out: an orthographic camera has a view_plane");
    if (!plane && members.is_object()) members.object().fail_at("view_plane", "is required by an orthographic camera");
  } else {
    if (plane.has_value() == fov.has_value() && members.is_object()) {
      members.object().fail("needs exactly one of view_plane and vertical_fov");
    }
    constexpr Range between_0_and_180{0, 180, true, true};
    if (fov) camera.vertical_fov_degrees = read_number(*fov, between_0_and_180);
  }
  if (plane) camera.view_plane = read_view_plane(*plane, kind == scene::Projection::perspective);
  return camera;
}

}  // namespace

scene::Camera read_camera(const Field& field) {
  Members members(field);
  scene::Camera camera = read_projection(members);
  const std::optional<Vec3> position = members.required("position", read_point);
  const std::optional<Vec3> direction = read_view_direction(members, position);
  camera.position = position.value_or(camera.position);
  camera.direction = direction.value_or(camera.direction);
  camera.up = read_up(members, direction);
  if (const std::optional<Field> lens = members.optional("lens")) camera.lens = read_lens(*lens);
  members.refuse_unknown();
  return camera;
}

}  // namespace penumbra::api
