#pragma once

namespace penumbra::shading {

/// Parts of shading that only save time. Each may be switched off: the image stays the same.
struct Switches {
  bool shadow_candidates = true;  // one query of a light's whole cone instead of a ray per sample
  bool light_cells = true;        // points side by side on a plane share what may hide a light
};

}  // namespace penumbra::shading
