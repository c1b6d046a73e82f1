#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/accel/triangle_set.h"
#include "engine/accel/view_cone.h"
#include "engine/geometry/surface.h"

namespace penumbra::accel {

using geometry::SurfaceId;
class OwnedTriangles;

/// A plane seen from an apex: the point p appears at (x·p', y·p') / (w·p') with p' = p − apex, and is in front of the
/// apex where w·p' > 0 and, unless the plane is infinitely far, before the plane where w·p' < 1.
struct Projection {
  Vec3 apex, x, y, w;
  bool is_infinite;
  Vec3 on_surface;  // which the apex was moved off by a few roundings
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

/// The plane of a triangle, which tells what side of it is seen.
struct Facing {
  Vec3 origin, normal;
  explicit Facing(const geometry::TriangleVertices& t) : origin(t.v0), normal(math::cross(t.v1 - t.v0, t.v2 - t.v0)) {}
  /// Whether the triangle winds counter-clockwise as the apex sees it: always the same answer for one triangle, whoever
  /// of its neighbours asks.
  bool winds_counter_clockwise(const Vec3& apex) const { return math::dot(normal, origin - apex) > 0; }
};

/// How many more triangles are in line right of an edge than left of it: its own triangle lies left where it winds
/// counter-clockwise, and the one across right. Those that are not there, or hold the apex, count for nothing.
constexpr int jump_at(bool has_own, bool own_is_left, bool has_other, bool other_is_right) {
  return (has_other ? (other_is_right ? 1 : -1) : 0) - (has_own ? (own_is_left ? 1 : -1) : 0);
}

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
    // Of the edge's triangle and the one across: see Facing.
    double origin[2][3][width], normal[2][3][width];
    SurfaceId triangle[2][width];
    std::uint32_t edge[width];
    std::uint8_t has_other = 0, has_edge = 0;  // a bit a lane
  };

 private:
  std::vector<Block> blocks_;
  std::size_t size_ = 0;
};

}  // namespace penumbra::accel
