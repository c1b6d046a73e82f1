#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/accel/triangle_set.h"
#include "engine/accel/wide_walk.h"
#include "engine/geometry/surface.h"
#include "engine/shading/shadows/view_cone.h"

namespace penumbra::shading::shadows {

using accel::OwnedTriangles;
using accel::TriangleSet;
using geometry::SurfaceId;

/// A plane seen from an apex: the point p appears at (x·p', y·p') / (w·p') with p' = p − apex, and is in front of the
/// apex where w·p' > 0 and, unless the plane is infinitely far, before the plane where w·p' < 1.
struct Projection {
  Vec3 apex, x, y, w;
  bool is_infinite;
  double rounding;  // of the apex' coordinates, see Apex
  /// Around everything that is looked at, in world space; the default in the space of a placement.
  ViewCone cone;
  /// What winds counter-clockwise seen from outside does so where the plane shows its back.
  bool is_mirrored = math::dot(math::cross(x, y), w) < 0;

  /// The homogeneous coordinates of p.
  Vec3 operator()(const Vec3& p) const {
    const Vec3 offset = p - apex;
    return {math::dot(x, offset), math::dot(y, offset), math::dot(w, offset)};
  }
};

/// An edge at which the number of opaque triangles in line changes: whoever crosses it from the left of from → to to
/// its right has `jump` more before him. Homogeneous coordinates of a projection.
struct SilhouetteEdge {
  Vec3 from, to;
  int jump = 0;
  struct Place {
    SurfaceId triangle;
    std::uint32_t edge = 0;  // of the triangle
    auto operator<=>(const Place&) const = default;
  } place;
};

/// Which triangles count, and how. The number in line with a point of the disc is the sum, over all triangles, of how
/// often their outline winds around that point: so whatever is left out must be left out as a whole triangle, of which
/// both sides of each of its edges then know nothing. That is told by the triangle and the apex alone, the same for
/// whoever asks; a triangle is left out that no segment to the disc crosses, or none but by a width of rounding:
///   coplanar with the apex, or through it: seen edge-on, within rounding (TrianglePlane::side is 0);
///   the apex' own; wholly beyond the disc's plane; touching or crossing that plane, but beside the segments.
/// One that crosses the plane between segments is not understood: rays tell. One wholly before the plane counts
/// wherever it is, behind the apex too, for there its outline winds around nothing in the disc. −1 where it lies left
/// of its own edges as they are seen, +1 where right, 0 where it is left out.
inline int winding(const geometry::TrianglePlane& plane, const Projection& projection) {
  const int side = plane.side(projection.apex, projection.rounding);
  return projection.is_mirrored ? -side : side;
}

/// How many more triangles are in line right of an edge than left of it, from the winding of its own triangle and of
/// the one across, which runs along it the other way.
constexpr int jump_at(int own, int other) { return own - other; }

/// Whether some of the triangle (in homogeneous coordinates) lies in the disc's cone, before the disc's plane or in it.
bool meets_cone(const std::array<Vec3, 3>& v);

/// Whether the edge lies on the outer side of a line through the square |x|, |y| ≤ 1 (of homogeneous coordinates).
inline bool is_beside_square(const Vec3& a, const Vec3& b) {
  return (a.x > a.z && b.x > b.z) || (-a.x > a.z && -b.x > b.z) || (a.y > a.z && b.y > b.z) ||
         (-a.y > a.z && -b.y > b.z);
}

/// Of |a|·|b|, in the sums of components' sizes: what the components of a × b may be off by.
inline constexpr double cross_error = 0x1p-50;

/// Whether the line through both points surely misses the disc x² + y² ≤ 1. Most edges around an apex on a curved
/// surface do, though they cross the lines around the square.
inline bool misses_disc(const Vec3& a, const Vec3& b) {
  const double x = a.y * b.z - a.z * b.y, y = a.z * b.x - a.x * b.z, z = a.x * b.y - a.y * b.x;
  const double size =
      (std::fabs(a.x) + std::fabs(a.y) + std::fabs(a.z)) * (std::fabs(b.x) + std::fabs(b.y) + std::fabs(b.z));
  const double distance = std::fabs(z) - cross_error * size;
  return distance > 0 && distance * distance > x * x + y * y;
}

/// Where on the way from `a` to `b` (homogeneous) the rim x² + y² = 1 is met: t of both places, ascending.
struct RimMeetings {
  double first, second;
  bool exist;
};
RimMeetings meet_rim(const Vec3& a, const Vec3& b);

/// Whether some of the edge lies in the disc and before the apex. Unlike the tests above it rejects all that is not in
/// sight: how many edges are left does not depend on what has found them.
bool is_in_disc(const Vec3& a, const Vec3& b);

/// Edges that may be silhouettes seen from somewhere, for SIMD.
class EdgeList {
 public:
  EdgeList() = default;
  /// For viewpoints in a ball.
  EdgeList(const Vec3& middle, double radius) : middle_(middle), radius_(radius) {}
  void reserve(std::size_t edges) { blocks_.reserve((edges + width - 1) / width); }
  /// The edge of a triangle, between it and the one across, if there is one.
  void add(const OwnedTriangles& triangles, std::uint32_t triangle, std::uint32_t edge);
  std::size_t size() const { return size_; }

  /// Appends the edges that are silhouettes and neither beside the square nor on a line that misses the disc; triangles
  /// that are `self` count for nothing. To the last bit what Candidates finds without a list. All edges but those of
  /// `self` lie before the plane.
  void append(const Projection& projection, const SurfaceId& self, std::vector<SilhouetteEdge>& silhouette) const;

  static constexpr std::size_t width = 8;
  struct Block {
    alignas(64) double from[3][width], to[3][width];
    // Of the edge's triangle and the one across: see TrianglePlane.
    double origin[2][3][width], normal[2][3][width];
    double size[2][width], span[2][width];
    SurfaceId triangle[2][width];
    std::uint32_t edge[width];
    std::uint8_t has_other = 0, has_edge = 0;  // a bit a lane
    double certain = 0;  // seen from where the edges are listed for, rounding decides of no value beyond this
  };

 private:
  /// The most that viewpoints' coordinates are off for `certain` to hold.
  double most_rounding() const { return math::gamma(256) * (math::taxicab(middle_) + radius_); }

  Vec3 middle_;
  double radius_ = 0;
  std::vector<Block> blocks_;
  std::size_t size_ = 0;
};

}  // namespace penumbra::shading::shadows
