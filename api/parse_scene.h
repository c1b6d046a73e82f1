#pragma once
#include "api/fields.h"
#include "api/job_request.h"

namespace penumbra::api {

/// Reads `scene`; what is wrong is reported and left out or keeps its default.
scene::Description read_scene(const Field& field, const Limits& limits);

}  // namespace penumbra::api
