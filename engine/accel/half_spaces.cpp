#include "engine/accel/half_spaces.h"

#include <algorithm>
#include <cmath>

#include "engine/accel/wide_tree.h"
#include "engine/math/constants.h"
#include "engine/math/error_free.h"

namespace penumbra::accel {
namespace {

using math::abs;
using math::dot;
using math::gamma;
using math::taxicab;

}  // namespace

HalfSpaces::HalfSpaces(const Vec3& base, double reach, const math::Bounds& bounds)
    : base_(base), reach_(reach), bounds_(bounds) {
  const Vec3 margin = Vec3{reach, reach, reach} * gamma(16);
  bounds_.lower = bounds_.lower - margin;
  bounds_.upper = bounds_.upper + margin;
}

HalfSpaces::Side HalfSpaces::side(const Vec3& outward, double offset) const {
  const Vec3 size = abs(outward);
  return {outward, size, offset, gamma(64) * (size.x + size.y + size.z) * reach_};
}

void HalfSpaces::add(const Vec3& outward, double offset) {
  sides_[static_cast<std::size_t>(count_++)] = side(outward, offset);
}

void HalfSpaces::add_limit(const Vec3& outward, double offset) {
  limits_[static_cast<std::size_t>(limit_count_++)] = side(outward, offset);
}

void HalfSpaces::add_floor(const Vec3& up, double nearby) {
  add(-up, 0);
  Side& side = sides_[static_cast<std::size_t>(count_ - 1)];
  // However far the light is: what is near must not be taken for rounding of its place.
  side.slack = gamma(64) * (side.size.x + side.size.y + side.size.z) * nearby;
  side.offset = -3 * side.slack;
  side.own_slack = -2 * gamma(64);
}

bool HalfSpaces::is_apart(const Vec3& lower, const Vec3& upper) const {
  return lower.x > bounds_.upper.x || upper.x < bounds_.lower.x || lower.y > bounds_.upper.y ||
         upper.y < bounds_.lower.y || lower.z > bounds_.upper.z || upper.z < bounds_.lower.z;
}

bool HalfSpaces::miss(const math::Bounds& box) const {
  if (is_apart(box.lower, box.upper)) return true;
  const Vec3 half = box.extent() * 0.5, center = box.center() - base_;
  return std::any_of(sides_.begin(), sides_.begin() + count_, [&](const Side& side) {
    const double radius = dot(side.size, half);
    return dot(side.outward, center) - radius > side.offset + side.slack + gamma(32) * radius;
  });
}

bool HalfSpaces::miss(const geometry::TriangleVertices& triangle) const {
  // What the triangle's own box would reject: so the answer does not depend on the boxes around it.
  const Vec3 lower = math::min(triangle.v0, math::min(triangle.v1, triangle.v2));
  const Vec3 upper = math::max(triangle.v0, math::max(triangle.v1, triangle.v2));
  if (is_apart(lower, upper)) return true;
  const Vec3 a = triangle.v0 - base_, b = triangle.v1 - base_, c = triangle.v2 - base_;
  const Vec3 size = math::max(abs(a), math::max(abs(b), abs(c)));
  return std::any_of(sides_.begin(), sides_.begin() + count_, [&](const Side& side) {
    const double threshold = side.offset + side.slack + side.own_slack * dot(side.size, size);
    return dot(side.outward, a) > threshold && dot(side.outward, b) > threshold && dot(side.outward, c) > threshold;
  });
}

bool HalfSpaces::miss(const geometry::SphereShape& sphere) const {
  const Vec3 reach{sphere.radius, sphere.radius, sphere.radius};
  if (is_apart(sphere.center - reach, sphere.center + reach)) return true;
  const Vec3 center = sphere.center - base_;
  return std::any_of(sides_.begin(), sides_.begin() + count_, [&](const Side& side) {
    const double radius = math::length(side.outward) * sphere.radius;
    return dot(side.outward, center) - radius >
           side.offset + side.slack + gamma(32) * (radius + dot(side.size, abs(center)));
  });
}

bool HalfSpaces::miss(const geometry::CylinderShape& cylinder) const {
  const Vec3 half = cylinder.axis * (cylinder.height * 0.5), center = cylinder.base + half - base_;
  const double size = cylinder.height + cylinder.radius;
  return std::any_of(sides_.begin(), sides_.begin() + count_, [&](const Side& side) {
    const double of_axis = dot(side.outward, center) - std::fabs(dot(side.outward, half));
    if (of_axis <= side.offset) return false;
    // A cap reaches as far as its radius times the normal's share along it. The axis is unit but for rounding.
    const double along = dot(side.outward, cylinder.axis), across = dot(side.outward, side.outward) - along * along;
    const double length = side.size.x + side.size.y + side.size.z;
    const double rounding =
        gamma(64) * (dot(side.size, abs(center)) + length * size) + 0x1p-24 * length * cylinder.radius;
    return of_axis - cylinder.radius * std::sqrt(std::max(0.0, across)) > side.offset + side.slack + rounding;
  });
}

bool HalfSpaces::is_within_limits(const geometry::TriangleVertices& triangle) const {
  return std::all_of(limits_.begin(), limits_.begin() + limit_count_, [&](const Side& side) {
    const auto is_inside = [&](const Vec3& v) {
      const Vec3 way = v - base_;
      return dot(side.outward, way) < side.offset - side.slack - gamma(32) * dot(side.size, abs(way));
    };
    return is_inside(triangle.v0) && is_inside(triangle.v1) && is_inside(triangle.v2);
  });
}

HalfSpaces::FloatPlanes::Plane HalfSpaces::in_single_precision(const Side& side, const Vec3& base) const {
  // Normals scaled to 1, so that products of single precision neither overflow nor vanish.
  const double scale = 1 / std::max(math::max_component(side.size), 1e-300);
  FloatPlanes::Plane plane;
  const double offset = side.offset + dot(side.outward, base);
  for (int axis = 0; axis < 3; ++axis) {
    plane.outward[axis] = static_cast<float>(side.outward[axis] * scale);
    plane.nearest_row[axis] = plane.outward[axis] > 0 ? axis : axis + 3;
  }
  plane.offset = static_cast<float>(offset * scale);
  // |outward| ≤ the sum of its components, of which the largest is 1: an upper bound within rounding.
  plane.length = static_cast<float>(std::sqrt(dot(side.outward, side.outward)) * scale * (1 + 0x1p-22));
  plane.rounding = static_cast<float>(8 * 0x1p-24 * (side.size.x + side.size.y + side.size.z) * scale * (1 + 0x1p-20));
  plane.slack =
      static_cast<float>((side.slack + 8 * 0x1p-24 * (std::fabs(offset) + dot(side.size, abs(base)))) * scale);
  return plane;
}

HalfSpaces::FloatPlanes HalfSpaces::in_single_precision(const Vec3& origin) const {
  FloatPlanes result;
  result.count = count_;
  result.limit_count = limit_count_;
  for (int axis = 0; axis < 3; ++axis) {
    result.lower[axis] = rounded_down(bounds_.lower[axis] - origin[axis]);
    result.upper[axis] = rounded_up(bounds_.upper[axis] - origin[axis]);
  }
  const Vec3 base = base_ - origin;
  for (int i = 0; i < count_; ++i) result.plane[i] = in_single_precision(sides_[static_cast<std::size_t>(i)], base);
  for (int i = 0; i < limit_count_; ++i)
    result.limit[i] = in_single_precision(limits_[static_cast<std::size_t>(i)], base);
  return result;
}

HalfSpaces pyramid(const Vec3& apex, const std::array<Vec3, 4>& corners, bool is_infinite, const Vec3& floor) {
  std::array<Vec3, 4> edges;
  for (std::size_t i = 0; i < 4; ++i) edges[i] = is_infinite ? corners[i] : corners[i] - apex;
  math::Bounds bounds;
  bounds.include(apex);
  double reach = taxicab(apex);
  Vec3 middle;
  for (std::size_t i = 0; i < 4; ++i) {
    middle += edges[i] * 0.25;
    reach = std::max(reach, taxicab(corners[i]));
    if (!is_infinite) {
      bounds.include(corners[i]);
      continue;
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (edges[i][axis] > 0) bounds.upper[axis] = math::infinity;
      if (edges[i][axis] < 0) bounds.lower[axis] = -math::infinity;
    }
  }
  HalfSpaces result(apex, reach, bounds);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 outward = math::cross(edges[i], edges[(i + 1) % 4]);
    result.add(dot(outward, middle) > 0 ? -outward : outward, 0);
  }
  // Across the quadrilateral: all edges lead to that side of the apex, also where a placement's space is sheared.
  Vec3 forward = math::cross(corners[1] - corners[0], corners[3] - corners[0]);
  if (dot(forward, middle) < 0) forward = -forward;
  if (!is_infinite) {
    double farthest = 0;
    for (const Vec3& edge : edges) farthest = std::max(farthest, dot(forward, edge));
    result.add(forward, farthest);
    result.add_limit(forward, farthest);
  }
  result.add(-forward, 0);
  if (taxicab(floor) > 0) result.add_floor(floor, taxicab(apex));
  return result;
}

}  // namespace penumbra::accel
