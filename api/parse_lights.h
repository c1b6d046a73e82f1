#pragma once
#include <vector>

#include "api/fields.h"
#include "engine/scene/lights.h"

namespace penumbra::api {

/// Reads `scene.lights`; what is wrong is reported and left out.
std::vector<scene::Light> read_lights(const Field& field);

}  // namespace penumbra::api
