#pragma once
#include <functional>

#include "engine/accel/wide_tree.h"
#include "engine/scene/description.h"
#include "engine/scene/options.h"
#include "engine/shading/scene.h"

namespace penumbra::render {

struct CompileSettings {
  scene::Acceleration acceleration = scene::Acceleration::bvh;
  bool merge_lights = true;
  accel::ParallelFor parallel_for = accel::run_in_turn;
  std::function<bool()> is_canceled = [] { return false; };  // once true, what is left out does not matter
};

struct Compiled {
  shading::Scene scene;
  std::uint64_t merged_lights = 0;  // equal to another light, and added to it
};

/// What rays need, from what people wrote: transforms applied, polygons split, structures built, lights prepared.
Compiled compile(const scene::Description& description, const CompileSettings& settings);

}  // namespace penumbra::render
