#pragma once
#include <optional>

#include "engine/geometry/surface.h"
#include "engine/math/bounds.h"

namespace penumbra::geometry {

/// Which part of the same object a ray's origin lies on, if any.
using SelfPart = std::optional<std::uint32_t>;

struct SphereShape {
  Vec3 center;
  double radius;
};

/// The side of an infinite circular cylinder; `axis` is unit.
struct TubeShape {
  Vec3 point, axis;
  double radius;
};

/// From the base disc around `base` along the unit `axis`. Parts: side, base cap, top cap.
struct CylinderShape {
  Vec3 base, axis;
  double radius, height;
  bool caps;
};
inline constexpr std::uint32_t cylinder_side = 0, cylinder_base = 1, cylinder_top = 2;

/// `normal` is unit.
struct PlaneShape {
  Vec3 point, normal;
};

/// Crossings with t > 0, beyond the rounding error of t, and t < limit. With `self`, the crossing at the origin itself
/// is left out exactly and any other one is found stably; so is the crossing at the segment's end, if that lies on the
/// surface.
Crossings crossings(const SphereShape& sphere, const Segment& segment, SelfPart self);
Crossings crossings(const TubeShape& tube, const Segment& segment, SelfPart self);
Crossings crossings(const CylinderShape& cylinder, const Segment& segment, SelfPart self);
Crossings crossings(const PlaneShape& plane, const Segment& segment, SelfPart self);

/// The surface point nearest to `near`, a rounded point of crossing on part `part`.
SurfacePoint surface_at(const SphereShape& sphere, const Vec3& near, std::uint32_t part);
SurfacePoint surface_at(const TubeShape& tube, const Vec3& near, std::uint32_t part);
SurfacePoint surface_at(const CylinderShape& cylinder, const Vec3& near, std::uint32_t part);
SurfacePoint surface_at(const PlaneShape& plane, const Vec3& near, std::uint32_t part);

/// Enclosing boxes, rounded outwards; nothing for the infinite shapes.
std::optional<math::Bounds> bounds_of(const SphereShape& sphere);
std::optional<math::Bounds> bounds_of(const TubeShape& tube);
std::optional<math::Bounds> bounds_of(const CylinderShape& cylinder);
std::optional<math::Bounds> bounds_of(const PlaneShape& plane);

}  // namespace penumbra::geometry
