#pragma once
#include "engine/shading/switches.h"

namespace penumbra::render {

/// Parts of the renderer that only save time. Each may be switched off: the image stays the same.
struct Switches : shading::Switches {
  bool merge_lights = true;  // equal lights are evaluated once
  bool empty_tiles = true;   // no ray is cast where a tile shows nothing but the background
};

}  // namespace penumbra::render
