#include "engine/accel/shaft.h"

#include <algorithm>
#include <cmath>

#include "engine/math/error_free.h"

namespace penumbra::accel {
namespace {

using math::abs;
using math::dot;
using math::gamma;

double taxicab(const Vec3& v) { return std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z); }

/// The plane of a triangle, scaled, and which side a point is on for certain.
struct TrianglePlane {
  Vec3 origin, normal;
  double size;

  explicit TrianglePlane(const geometry::TriangleVertices& t)
      : origin(t.v0),
        normal(math::cross(t.v1 - t.v0, t.v2 - t.v0)),
        size(taxicab(t.v1 - t.v0) * taxicab(t.v2 - t.v0)) {}
  /// +1, −1, or 0 when rounding decides. `offset` = x − origin; `magnitude` bounds the coordinates it was taken from.
  int side(const Vec3& offset, double magnitude) const {
    const double value = dot(normal, offset), error = gamma(16) * size * (taxicab(offset) + magnitude);
    return value > error ? 1 : value < -error ? -1 : 0;
  }
};

}  // namespace

Shaft::Shaft(const Vec3& apex, const std::array<Vec3, 4>& corners, bool is_infinite, const Vec3& floor)
    : apex_(apex), corners_(corners), floor_(floor), is_infinite_(is_infinite) {
  for (std::size_t i = 0; i < 4; ++i) edges_[i] = is_infinite ? corners[i] : corners[i] - apex;
}

HalfSpaces Shaft::made_half_spaces() const {
  math::Bounds bounds;
  bounds.include(apex_);
  double reach = taxicab(apex_);
  Vec3 middle;
  for (std::size_t i = 0; i < 4; ++i) {
    middle += edges_[i] * 0.25;
    reach = std::max(reach, taxicab(corners_[i]));
    if (!is_infinite_) {
      bounds.include(corners_[i]);
      continue;
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (edges_[i][axis] > 0) bounds.upper[axis] = HUGE_VAL;
      if (edges_[i][axis] < 0) bounds.lower[axis] = -HUGE_VAL;
    }
  }
  HalfSpaces result(apex_, reach, bounds);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 outward = math::cross(edges_[i], edges_[(i + 1) % 4]);
    result.add(dot(outward, middle) > 0 ? -outward : outward, 0);
  }
  // Across the quadrilateral: all edges lead to that side of the apex, also where a placement's space is sheared.
  Vec3 forward = math::cross(corners_[1] - corners_[0], corners_[3] - corners_[0]);
  if (dot(forward, middle) < 0) forward = -forward;
  if (!is_infinite_) {
    double farthest = 0;
    for (const Vec3& edge : edges_) farthest = std::max(farthest, dot(forward, edge));
    result.add(forward, farthest);
    result.add_limit(forward, farthest);
  }
  result.add(-forward, 0);
  if (taxicab(floor_) > 0) result.add_floor(floor_, taxicab(apex_));
  return result;
}

Shaft Shaft::in_space_of(const Placement& placement) const {
  const math::Affine& map = placement.world_to_local;
  std::array<Vec3, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = is_infinite_ ? map.vector(corners_[i]) : map.point(corners_[i]);
  return {map.point(apex_), corners, is_infinite_, placement.local_to_world.transposed_vector(floor_)};
}

bool Shaft::misses(const geometry::TriangleVertices& triangle) const {
  if (half_spaces().miss(triangle)) return true;
  const Vec3 a = triangle.v0 - apex_;
  const TrianglePlane plane(triangle);
  const double magnitude = taxicab(apex_) + taxicab(triangle.v0);
  const int side = plane.side(-a, magnitude);
  // From a point in the triangle's plane the triangle is seen edge-on: its own test finds no crossing either.
  if (side == 0) return true;
  for (const Vec3& edge : edges_) {
    const int other = is_infinite_ ? plane.side(edge, taxicab(edge)) : plane.side(edge - a, magnitude + taxicab(edge));
    // Towards infinity only a direction that leads away from the plane (or along it) stays on this side.
    if (other != side) return false;
  }
  return true;
}

bool Shaft::misses(const geometry::PlaneShape& plane) const {
  const double height = dot(plane.normal, apex_ - plane.point);
  const double error = gamma(16) * dot(abs(plane.normal), abs(apex_) + abs(plane.point));
  // From a point in the plane no segment crosses it.
  if (std::fabs(height) <= error) return true;
  return std::all_of(edges_.begin(), edges_.end(), [&](const Vec3& edge) {
    const double slope = dot(plane.normal, edge), end = is_infinite_ ? slope : height + slope;
    return (height > 0 ? end : -end) > error + gamma(16) * dot(abs(plane.normal), abs(edge));
  });
}

bool Shaft::misses(const geometry::TubeShape& tube) const {
  if (is_infinite_) return false;
  // Across the axis the tube is a disc around 0 and the shaft the hull of five points: they are apart if the point of
  // the hull's outline nearest to 0 is farther than the radius and the whole hull lies behind it.
  std::array<Vec3, 5> points;
  double size = tube.radius + taxicab(apex_) + taxicab(tube.point);
  for (std::size_t i = 0; i < 5; ++i) {
    const Vec3 p = (i < 4 ? corners_[i] : apex_) - tube.point;
    points[i] = p - tube.axis * dot(p, tube.axis);
    size = std::max(size, taxicab(p));
  }
  Vec3 nearest = points[0];
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = i + 1; k < 5; ++k) {
      const Vec3 along = points[k] - points[i];
      const double squared = dot(along, along);
      const double t = squared > 0 ? std::clamp(-dot(points[i], along) / squared, 0.0, 1.0) : 0;
      const Vec3 q = points[i] + along * t;
      if (dot(q, q) < dot(nearest, nearest)) nearest = q;
    }
  }
  const double distance = math::length(nearest), error = gamma(64) * size;
  if (!(distance > tube.radius + error)) return false;
  return std::all_of(points.begin(), points.end(),
                     [&](const Vec3& p) { return dot(p, nearest) > (tube.radius + error) * distance; });
}

bool Shaft::is_covered_by(const geometry::TriangleVertices& triangle) const {
  const Vec3 vertex[3]{triangle.v0 - apex_, triangle.v1 - apex_, triangle.v2 - apex_};
  const TrianglePlane plane(triangle);
  const double magnitude = taxicab(apex_) + taxicab(triangle.v0);
  const int side = plane.side(-vertex[0], magnitude);
  if (side == 0) return false;
  for (const Vec3& edge : edges_) {
    const int other = is_infinite_ ? plane.side(edge, 0) : plane.side(edge - vertex[0], magnitude + taxicab(edge));
    if (other != -side) return false;
  }
  for (int i = 0; i < 3; ++i) {
    const Vec3 &from = vertex[i], &to = vertex[(i + 1) % 3];
    const Vec3 inward = math::cross(from, to) * -static_cast<double>(side);
    const double size = taxicab(from) * taxicab(to) + magnitude * (taxicab(from) + taxicab(to));
    for (const Vec3& edge : edges_) {
      if (!(dot(inward, edge) > gamma(16) * size * taxicab(edge))) return false;
    }
  }
  return true;
}

}  // namespace penumbra::accel
