#include "engine/shading/shadows/shaft.h"

#include <algorithm>
#include <cmath>

#include "engine/math/error_free.h"

namespace penumbra::shading::shadows {
namespace {

using math::abs;
using math::dot;
using math::gamma;
using math::taxicab;

}  // namespace

Shaft::Shaft(const Apex& apex, const std::array<Vec3, 4>& corners, bool is_infinite, const Vec3& floor)
    : apex_(apex.place), rounding_(apex.rounding), corners_(corners), floor_(floor), is_infinite_(is_infinite) {
  for (std::size_t i = 0; i < 4; ++i) edges_[i] = is_infinite ? corners[i] : corners[i] - apex_;
}

Shaft Shaft::in_space_of(const Placement& placement) const {
  const math::Affine& map = placement.world_to_local;
  std::array<Vec3, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = is_infinite_ ? map.vector(corners_[i]) : map.point(corners_[i]);
  const double rounding = accel::rounding_after(map, math::abs(apex_), rounding_);
  return {{map.point(apex_), rounding}, corners, is_infinite_, placement.local_to_world.transposed_vector(floor_)};
}

bool Shaft::misses(const geometry::TriangleVertices& triangle) const {
  if (half_spaces().miss(triangle)) return true;
  const geometry::TrianglePlane plane(triangle);
  const int side = plane.side(apex_, rounding_);
  // From a point in the triangle's plane the triangle is seen edge-on: its own test finds no crossing either.
  if (side == 0) return true;
  // Towards infinity only a direction that leads away from the plane (or along it) stays on this side.
  return std::ranges::all_of(is_infinite_ ? edges_ : corners_, [&](const Vec3& end) {
    return (is_infinite_ ? plane.side_towards(end) : plane.side(end, rounding_)) == side;
  });
}

bool Shaft::misses(const geometry::PlaneShape& plane) const {
  const double height = dot(plane.normal, apex_ - plane.point);
  const double error = gamma(16) * dot(abs(plane.normal), abs(apex_) + abs(plane.point)) + rounding_;
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
  const geometry::TrianglePlane plane(triangle);
  const double magnitude = taxicab(apex_) + taxicab(triangle.v0);
  const int side = plane.side(apex_, rounding_);
  if (side == 0) return false;
  for (std::size_t i = 0; i < 4; ++i) {
    if ((is_infinite_ ? plane.side_towards(edges_[i]) : plane.side(corners_[i], rounding_)) != -side) return false;
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

}  // namespace penumbra::shading::shadows
