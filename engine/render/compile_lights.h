#pragma once
#include <vector>

#include "engine/render/compile.h"

namespace penumbra::render {

/// The lights as rays need them; `merged` counts those that equal another but for their brightness, and were added to
/// it. `world` has been compiled.
std::vector<shading::Light> compile_lights(const std::vector<scene::Light>& lights, const accel::World& world,
                                           const CompileSettings& settings, std::uint64_t& merged);

}  // namespace penumbra::render
