#pragma once
#include <array>
#include <cmath>
#include <vector>

#include "engine/geometry/quadrics.h"
#include "engine/geometry/triangle.h"
#include "engine/math/affine.h"
#include "engine/math/color.h"
#include "engine/math/constants.h"
#include "engine/shading/shadows/sphere_list.h"

namespace penumbra::shading::shadows {

using math::Color;
using math::Vec3;

/// A disc light seen from a point `from`: its samples lie at from + axis + x·u + y·v with x² + y² ≤ 1, or in those
/// directions when `is_infinite`.
struct DiscView {
  Vec3 from, axis, u, v;
  bool is_infinite = false;

  /// The way from `from` to the point (x, y) of the disc, or its direction.
  Vec3 at(double x, double y) const { return axis + u * x + v * y; }
  /// Of segments to it, in units of the way to its points.
  double limit() const { return is_infinite ? math::infinity : 1; }

  DiscView in_space(const math::Affine& world_to_local) const {
    return {world_to_local.point(from), world_to_local.vector(axis), world_to_local.vector(u), world_to_local.vector(v),
            is_infinite};
  }
};

/// The plane of a disc that is not infinitely far: where normal·d = height, in the space of a placement not
/// perpendicular to the axis.
class DiscPlane {
 public:
  explicit DiscPlane(const DiscView& view);
  /// Whether the plane lies behind all of the ball around `center` (relative to the point), for certain.
  bool is_behind(const Vec3& center, double radius) const;

 private:
  Vec3 normal_;
  double height_, length_;  // length = |normal|
};

/// a + b·x + c·y over the disc's coordinates.
struct Linear {
  double a = 0, b = 0, c = 0;
};

/// a + 2b·x + 2c·y + d·x² + 2e·x·y + f·y² over the disc's coordinates.
struct Quadratic {
  double a = 0, b = 0, c = 0, d = 0, e = 0, f = 0;
};

/// A convex part of a disc that an occluder hides: where every one of `edges` is ≥ 0 and, if `is_round`, `round` too –
/// a cone around a sphere or disc, of which edges[0], if there is one, selects the half in front.
struct DiscCover {
  std::array<Linear, 4> edges{};
  std::size_t edge_count = 0;
  bool is_round = false;
  Quadratic round;
  /// What is left of light that crosses the occluder; black if opaque.
  Color transmittance;
  bool is_opaque = true;
  bool is_whole = false;  // covers the whole disc, for certain
};

/// How much of the disc a cover takes: none and all are certain.
enum class Extent { none, part, all };
Extent extent_of(const DiscCover& cover);
/// Of the line where one of a cover's edges is 0: the length that lies in the disc and between the other edges.
double length_in_disc(const DiscCover& cover, std::size_t edge);

/// Each appends what a shape hides of the disc, as covers that may overlap where the shape is opaque; false when it can
/// not be told this way: the point is in the shape or on it, or the shape reaches beyond the light.
bool append_cover(const geometry::TriangleVertices& triangle, const DiscView& view, std::vector<DiscCover>& covers);
bool append_cover(const geometry::SphereShape& sphere, const DiscView& view, std::vector<DiscCover>& covers);
/// The same for many spheres in one view, seen from view.from.
class SphereCovers {
 public:
  explicit SphereCovers(const DiscView& view);
  bool append(const SeenSphere& sphere, std::vector<DiscCover>& covers) const;

 private:
  const DiscView& view_;
  DiscPlane plane_;
  Quadratic squared_;  // |d|² of the disc's point d
};
/// The far side of a plane; the point does not lie in it.
bool append_cover(const geometry::PlaneShape& plane, const DiscView& view, std::vector<DiscCover>& covers);
/// Up to three covers, for an opaque cylinder with caps alone.
bool append_cover(const geometry::CylinderShape& cylinder, const DiscView& view, std::vector<DiscCover>& covers);
/// The far side of the surface with normal `facing` at the point.
DiscCover cover_below_horizon(const Vec3& facing, const DiscView& view);

}  // namespace penumbra::shading::shadows
