#pragma once
#include "engine/geometry/surface.h"
#include "engine/shading/scene.h"

namespace penumbra::shading {

/// A lit point: the surface, what it belongs to, and the viewer's side.
struct ShadingPoint {
  geometry::SurfacePoint surface;
  geometry::SurfaceId id;
  const CompiledMaterial* material = nullptr;
  Vec3 view;             // unit, the direction of the ray that came here
  Vec3 facing;           // the geometric normal, unit, on the viewer's side
  double footprint = 0;  // about how wide a pixel is here, in units of the scene; 0 = not known
};

}  // namespace penumbra::shading
