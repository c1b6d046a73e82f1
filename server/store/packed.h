#pragma once
#include <string>
#include <string_view>

#include "api/problem.h"
#include "engine/render/stats.h"

namespace penumbra::store {

// Values in one column of text: strings and numbers one after the other, each as LENGTH:TEXT. (A JSON library would
// need memory to give memory back, and end the program where there is none.)

std::string packed(const api::Problem& problem);
std::string packed(const render::Stats& stats);
/// Throw std::runtime_error when the text is not what `packed` made.
api::Problem unpacked_problem(std::string_view text);
render::Stats unpacked_stats(std::string_view text);

}  // namespace penumbra::store
