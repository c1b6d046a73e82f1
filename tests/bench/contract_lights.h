#pragma once
#include <variant>
#include <vector>

#include "engine/scene/description.h"

namespace penumbra::bench {

using AreaLight = std::variant<scene::RectangleLight, scene::SphereLight>;

/// The lights of a scene in the two forms the peers know: discs (or points) that face what they light, and areas.
struct ContractLights {
  std::vector<scene::SpotLight> discs;
  std::vector<AreaLight> areas;
};

/// Equal discs added up. Throws std::invalid_argument for directional lights, rectangles that are none, and area lights
/// on shiny things.
ContractLights lights_of(const scene::Description& description);

}  // namespace penumbra::bench
