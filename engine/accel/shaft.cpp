#include "engine/accel/shaft.h"

#include <algorithm>
#include <cmath>

#include "engine/accel/wide_tree.h"
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
  bounds_.include(apex);
  double reach = taxicab(apex);
  Vec3 middle;
  for (std::size_t i = 0; i < 4; ++i) {
    edges_[i] = is_infinite ? corners[i] : corners[i] - apex;
    middle += edges_[i] * 0.25;
    reach = std::max(reach, taxicab(corners[i]));
    if (!is_infinite) {
      bounds_.include(corners[i]);
      continue;
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (edges_[i][axis] > 0) bounds_.upper[axis] = HUGE_VAL;
      if (edges_[i][axis] < 0) bounds_.lower[axis] = -HUGE_VAL;
    }
  }
  // A plane through the apex and two corners is off by a few roundings of their coordinates anywhere in the shaft.
  const auto add_side = [&](const Vec3& outward, double offset) {
    sides_[static_cast<std::size_t>(side_count_++)] = {outward, abs(outward), offset,
                                                       gamma(64) * taxicab(outward) * reach};
  };
  side_count_ = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    Vec3 outward = math::cross(edges_[i], edges_[(i + 1) % 4]);
    if (dot(outward, middle) > 0) outward = -outward;
    add_side(outward, 0);
  }
  Vec3 forward = middle;
  if (!is_infinite) {
    forward = math::cross(corners[1] - corners[0], corners[3] - corners[0]);
    if (dot(forward, middle) < 0) forward = -forward;
    double farthest = 0;
    for (const Vec3& edge : edges_) farthest = std::max(farthest, dot(forward, edge));
    add_side(forward, farthest);
  }
  add_side(-forward, 0);
  if (taxicab(floor) > 0) add_side(-floor, 0);
  const Vec3 margin = abs(apex) * gamma(8) + Vec3{reach, reach, reach} * gamma(8);
  bounds_.lower = bounds_.lower - margin;
  bounds_.upper = bounds_.upper + margin;
}

Shaft Shaft::in_space_of(const Placement& placement) const {
  const math::Affine& map = placement.world_to_local;
  std::array<Vec3, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = is_infinite_ ? map.vector(corners_[i]) : map.point(corners_[i]);
  return {map.point(apex_), corners, is_infinite_, placement.local_to_world.transposed_vector(floor_)};
}

bool Shaft::is_apart(const Vec3& lower, const Vec3& upper) const {
  return lower.x > bounds_.upper.x || upper.x < bounds_.lower.x || lower.y > bounds_.upper.y ||
         upper.y < bounds_.lower.y || lower.z > bounds_.upper.z || upper.z < bounds_.lower.z;
}

bool Shaft::misses(const math::Bounds& box) const {
  if (is_apart(box.lower, box.upper)) return true;
  const Vec3 half = box.extent() * 0.5, centre = box.centre() - apex_;
  for (int i = 0; i < side_count_; ++i) {
    const Side& side = sides_[static_cast<std::size_t>(i)];
    const double radius = dot(side.size, half);
    if (dot(side.outward, centre) - radius > side.offset + side.slack + gamma(32) * radius) return true;
  }
  return false;
}

Shaft::BoxPlanes Shaft::box_planes(const Vec3& origin) const {
  BoxPlanes result;
  result.count = side_count_;
  result.far = is_infinite_ ? -1 : 4;
  for (int axis = 0; axis < 3; ++axis) {
    result.lower[axis] = rounded_down(bounds_.lower[axis] - origin[axis]);
    result.upper[axis] = rounded_up(bounds_.upper[axis] - origin[axis]);
  }
  for (int i = 0; i < side_count_; ++i) {
    const Side& side = sides_[static_cast<std::size_t>(i)];
    // Normals scaled to 1, so that products of single precision neither overflow nor vanish.
    const double scale = 1 / std::max(math::max_component(side.size), 1e-300);
    BoxPlanes::Plane& plane = result.plane[i];
    const Vec3 apex = apex_ - origin;
    const double offset = side.offset + dot(side.outward, apex);
    for (int axis = 0; axis < 3; ++axis) {
      plane.outward[axis] = static_cast<float>(side.outward[axis] * scale);
      plane.nearest_row[axis] = plane.outward[axis] > 0 ? axis : axis + 3;
    }
    plane.offset = static_cast<float>(offset * scale);
    plane.length = static_cast<float>(math::length(side.outward) * scale);
    plane.slack =
        static_cast<float>((side.slack + 8 * 0x1p-24 * (std::fabs(offset) + dot(side.size, abs(apex)))) * scale);
  }
  return result;
}

bool Shaft::misses(const geometry::TriangleVertices& triangle) const {
  // What the triangle's own box would reject: so the answer does not depend on the boxes around it.
  const Vec3 lower = math::min(triangle.v0, math::min(triangle.v1, triangle.v2));
  const Vec3 upper = math::max(triangle.v0, math::max(triangle.v1, triangle.v2));
  if (is_apart(lower, upper)) return true;
  const Vec3 a = triangle.v0 - apex_, b = triangle.v1 - apex_, c = triangle.v2 - apex_;
  const Vec3 size = math::max(abs(a), math::max(abs(b), abs(c)));
  for (int i = 0; i < side_count_; ++i) {
    const Side& side = sides_[static_cast<std::size_t>(i)];
    const double threshold = side.offset + side.slack + gamma(32) * dot(side.size, size);
    if (dot(side.outward, a) > threshold && dot(side.outward, b) > threshold && dot(side.outward, c) > threshold)
      return true;
  }
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

bool Shaft::misses(const geometry::SphereShape& sphere) const {
  const Vec3 reach{sphere.radius, sphere.radius, sphere.radius};
  if (is_apart(sphere.center - reach, sphere.center + reach)) return true;
  const Vec3 centre = sphere.center - apex_;
  for (int i = 0; i < side_count_; ++i) {
    const Side& side = sides_[static_cast<std::size_t>(i)];
    const double radius = math::length(side.outward) * sphere.radius;
    if (dot(side.outward, centre) - radius >
        side.offset + side.slack + gamma(32) * (radius + dot(side.size, abs(centre))))
      return true;
  }
  return false;
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
