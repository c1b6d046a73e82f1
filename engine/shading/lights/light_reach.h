#pragma once
#include <optional>

#include "engine/math/bounds.h"
#include "engine/shading/scene.h"
#include "engine/shading/shading_point.h"

/// How far lights reach: what holds for a light, or for many, and for all points of a region.
namespace penumbra::shading {

/// Points that are lit together, and what they send on of light.
struct LitRegion {
  math::Bounds positions;
  math::Bounds facings, normals, mirrors;  // unit vectors; `mirrors`: of the view
  Color diffuse, specular;                 // the most of them
  double shininess = math::infinity;       // the least
  double size = 0;                         // of the coordinates, added up

  /// `weight`: what share of the point's light arrives at the camera.
  void add(const ShadingPoint& at, const Color& weight);
};

/// Bounds of one light, or of several.
struct LightReach {
  math::Bounds places;               // where the light comes from, of discs their middle
  math::Bounds axes;                 // the ways that it mostly goes, unit vectors; of all ways, all
  double least_cosine = 1;           // between an axis and a way of its light
  double exponent = math::infinity;  // of that cosine: how the light falls off towards the sides, at least
  bool is_even = true;               // all light goes all ways
  Color intensity;
  scene::Attenuation attenuation{math::infinity, math::infinity, math::infinity};
  double size = 0;  // of the coordinates, added up

  void include(const LightReach& other);
  /// False only if no light adds anything to any point: beyond rounding on the far side of the surface, or going
  /// elsewhere.
  bool may_light(const LitRegion& region) const;
  /// Whether that is the answer for none of the lights, each for itself.
  bool lights_for_certain(const LitRegion& region) const;
  /// What the lights together add at most to any channel of any point.
  double most(const LitRegion& region) const;
};

/// Nothing for a light from infinitely far away.
std::optional<LightReach> reach_of(const Light& light);

}  // namespace penumbra::shading
