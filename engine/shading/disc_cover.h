#pragma once
#include <array>
#include <optional>
#include <span>

#include "engine/geometry/quadrics.h"
#include "engine/geometry/triangle.h"
#include "engine/math/color.h"
#include "engine/sampling/halves.h"
#include "engine/sampling/patterns.h"

namespace penumbra::shading {

using math::Color;
using math::Vec3;

/// A disc light seen from a point `from`: its samples lie at from + axis + x·u + y·v with x² + y² ≤ 1, or in those
/// directions when `is_infinite`.
struct DiscView {
  Vec3 from, axis, u, v;
  bool is_infinite = false;
};

/// a + b·x + c·y over the disc's coordinates.
struct Linear {
  double a = 0, b = 0, c = 0;
};

/// The part of a disc an occluder hides: where every `edges[i]` ≥ 0, and, if `is_round`, where in addition
/// squared(along) ≥ keen · |sample|² – the cone around a sphere. Convex either way.
struct DiscCover {
  std::array<Linear, 4> edges{};
  bool is_round = false;
  double keen = 0;
  /// What is left of light that crosses the occluder; black if opaque.
  Color transmittance;
  bool is_opaque = true;
  geometry::SurfaceId place;  // what it belongs to
};

/// Nothing when the point lies in the triangle's plane: then no sample is hidden.
std::optional<DiscCover> cover_of(const geometry::TriangleVertices& triangle, const DiscView& view);
/// Nothing when the sphere is not met twice or not at all by every segment: when the point is in or on it, or it
/// reaches beyond the light.
std::optional<DiscCover> cover_of(const geometry::SphereShape& sphere, const DiscView& view);
/// The far side of a plane; the point does not lie in it.
DiscCover cover_of(const geometry::PlaneShape& plane, const DiscView& view);
/// The far side of the surface with normal `facing` at the point.
DiscCover cover_below_horizon(const Vec3& facing, const DiscView& view);

/// The mean transmittance of a disc, from even and odd chords, behind these covers, integrated exactly along each
/// chord. `turn` ∈ [0, 1) turns the chords where no edge suggests a direction, `shift` ∈ [0, 1) displaces them. After
/// Billen, Dutré, "Line Sampling for Direct Illumination", EGSR 2016, with chords that cross the covers' edges.
sampling::Halves mean_transmittance(std::span<const DiscCover> covers, const DiscView& view,
                                    const sampling::DiscChords& chords, double turn, double shift);

}  // namespace penumbra::shading
