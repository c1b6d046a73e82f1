#pragma once
#include <string>
#include <vector>

#include "api/fields.h"
#include "api/job_request.h"

namespace penumbra::api {

/// An option to set whatever the body says about it.
struct Override {
  std::string name;
  JsonDocument value;
};

/// Reads `options` and, over them, `overrides`, of which a later one wins; what is wrong is reported.
scene::Options read_options(const Field& field, const std::vector<Override>& overrides, const Limits& limits);

}  // namespace penumbra::api
