#pragma once
#include <array>
#include <optional>

#include "engine/math/vec3.h"
#include "engine/sampling/patterns.h"

namespace penumbra::sampling {

using math::Vec3;

/// The directions in which a sphere is seen from outside it.
struct SphereCone {
  math::Frame frame;  // n towards the center
  double distance, radius;
  double one_minus_cosine;  // of the cone's half angle
  double solid_angle;       // steradians
};
/// Nothing when `from` is inside the sphere.
std::optional<SphereCone> cone_of_sphere(const Vec3& from, const Vec3& center, double radius);
/// A place as it is seen: the unit direction, and how far.
struct SeenPlace {
  Vec3 direction;
  double distance;
};
/// The point of the near side seen in a uniformly chosen direction of the cone.
SeenPlace point_in_cone(const SphereCone& cone, const Point2& square);

/// A uniform direction of the whole sphere, unit.
Vec3 direction_on_sphere(const Point2& square);

/// A parallelogram seen from the origin, sampled nearly uniformly by solid angle, whatever its size, shape and place:
/// first a line along its longer edge, about as often as its nearest point is near – density 1/distance² –, then a
/// place on that line, exactly by solid angle. Every sample carries the solid angle it stands for, which makes up for
/// the first choice. Both densities and their inverses are free of differences that cancel; so the mean is right, and
/// no sample stands for more than a few times the solid angle of the whole.
/// (Ureña, Fajardo, King, "An Area-Preserving Parametrization for Spherical Rectangles", EGSR 2013, choose the line
/// exactly, too, but by a difference of angles that loses its digits for small, thin, wide and edge-on rectangles.)
class SeenParallelogram {
 public:
  /// `normal` is the unit normal, and `corner` lies below the origin by it.
  SeenParallelogram(const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v, const Vec3& normal);
  struct Sample {
    Vec3 place;          // relative to where it is seen from
    double solid_angle;  // to weigh it with: the mean over samples is the solid angle of the whole
  };
  Sample sample(const Point2& square) const;

 private:
  /// Of the lines, those between shares `from` and `to` of the shorter edge, whose nearest points p + s·e are on a line
  /// themselves: |p|², p·e, |p × e|, the angle it fills and ∫ ds/|p + s·e|².
  struct Piece {
    double from = 0, to = 0;
    double squared = 0, dot = 0, cross = 0, angle = 0, mass = 0;
  };
  Piece piece(const Point2& start, const Point2& step, double from, double to) const;
  /// The share of the shorter edge at which the line of a uniform `share` starts.
  double line_at(double share) const;

  Vec3 across_, along_, down_;  // unit, in the plane and towards it
  double height_, length_;      // above the plane, and of the longer edge
  Point2 first_, step_;  // in the plane, across and along the lines: where the first starts, and how the others follow
  std::array<Piece, 3> pieces_;
  double mass_ = 0;
};

}  // namespace penumbra::sampling
