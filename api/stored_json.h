#pragma once
#include <string_view>

#include "api/problem.h"
#include "engine/render/stats.h"

namespace penumbra::api {

// The way back from what `to_json` wrote, for stores. Throw std::runtime_error when it is not that.

Problem problem_of(std::string_view json);
render::Stats stats_of(std::string_view json);

}  // namespace penumbra::api
