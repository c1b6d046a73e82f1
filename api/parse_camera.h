#pragma once
#include "api/fields.h"
#include "engine/scene/camera.h"

namespace penumbra::api {

/// Reads `scene.camera`; what is wrong is reported and keeps its default.
scene::Camera read_camera(const Field& field);

}  // namespace penumbra::api
