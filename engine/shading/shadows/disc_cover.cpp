#include "engine/shading/shadows/disc_cover.h"

#include <algorithm>
#include <cmath>

#include "engine/math/error_free.h"

namespace penumbra::shading::shadows {
namespace {

using math::cross;
using math::dot;

/// sign·(n·d − constant) for the disc's point d.
Linear linear(const Vec3& n, double constant, const DiscView& view, double sign) {
  return {sign * (dot(n, view.axis) - constant), sign * dot(n, view.u), sign * dot(n, view.v)};
}

/// Adds scale·|p(d)|² for the linear map p, given by where it takes the disc's axis, u and v.
void add_squared(double scale, const Vec3& axis, const Vec3& u, const Vec3& v, Quadratic& q) {
  q.a += scale * dot(axis, axis), q.b += scale * dot(axis, u), q.c += scale * dot(axis, v);
  q.d += scale * dot(u, u), q.e += scale * dot(u, v), q.f += scale * dot(v, v);
}

template <class Map>
void add_squared(double scale, const DiscView& view, const Map& map, Quadratic& q) {
  add_squared(scale, map(view.axis), map(view.u), map(view.v), q);
}

/// The disc around `center` (relative to the point) with unit `normal`, seen from one side.
void append_disc(const Vec3& center, const Vec3& normal, double radius, const DiscView& view,
                 std::vector<DiscCover>& covers) {
  DiscCover& cover = covers.emplace_back();  // in place: copied right away, it would have to wait for what was stored
  const double height = dot(normal, center);
  cover.edges[cover.edge_count++] = linear(normal, 0, view, height > 0 ? 1 : -1);
  cover.is_round = true;
  // A direction d meets the plane at height/(n·d)·d; from the center to there, times n·d:
  add_squared(
      -1, view, [&](const Vec3& d) { return d * height - center * dot(normal, d); }, cover.round);
  add_squared(
      radius * radius, view,
      [&](const Vec3& d) {
        return Vec3{dot(normal, d), 0, 0};
      },
      cover.round);
}

}  // namespace

DiscPlane::DiscPlane(const DiscView& view) : normal_(cross(view.u, view.v)), height_(dot(normal_, view.axis)) {
  if (height_ < 0) normal_ = -normal_, height_ = -height_;
  length_ = math::length(normal_);
}

bool DiscPlane::is_behind(const Vec3& center, double radius) const {
  return dot(normal_, center) + radius * length_ < height_ * (1 - math::gamma(32));
}

double length_in_disc(const DiscCover& cover, std::size_t edge) {
  const Linear& line = cover.edges[edge];
  const double squared = line.b * line.b + line.c * line.c;
  const double half_squared = 1 - line.a * line.a / squared;
  if (!(half_squared > 0)) return 0;
  // foot + t·(−c, b)/|(b, c)|
  const double norm = std::sqrt(squared);
  double end = std::sqrt(half_squared), begin = -end;
  for (std::size_t i = 0; i < cover.edge_count; ++i) {
    if (i == edge) continue;
    const Linear& other = cover.edges[i];
    const double value = other.a - line.a * (other.b * line.b + other.c * line.c) / squared;
    const double slope = (other.c * line.b - other.b * line.c) / norm;
    if (slope > 0) begin = std::max(begin, -value / slope);
    if (slope < 0) end = std::min(end, -value / slope);
    if (slope == 0 && value < 0) return 0;
  }
  return std::max(0.0, end - begin);
}

Extent extent_of(const DiscCover& cover) {
  Extent extent = Extent::all;
  for (std::size_t i = 0; i < cover.edge_count; ++i) {
    const Linear& edge = cover.edges[i];
    const double reach = std::sqrt(edge.b * edge.b + edge.c * edge.c);
    if (edge.a < -reach) return Extent::none;
    if (edge.a <= reach) extent = Extent::part;
  }
  if (cover.is_round) {
    // A bound of |q(x, y) − q(0, 0)| over the disc.
    const Quadratic& q = cover.round;
    const double reach = 2 * std::sqrt(q.b * q.b + q.c * q.c) + std::fabs(q.d) + 2 * std::fabs(q.e) + std::fabs(q.f);
    if (q.a < -reach) return Extent::none;
    return q.a > reach ? extent : Extent::part;
  }
  if (extent == Extent::all) return extent;
  // Lines that cross the disc may do so beside the cover.
  for (std::size_t i = 0; i < cover.edge_count; ++i) {
    if (length_in_disc(cover, i) > 0) return Extent::part;
  }
  return Extent::none;
}

bool append_cover(const geometry::TriangleVertices& triangle, const DiscView& view, std::vector<DiscCover>& covers) {
  const Vec3 a = triangle.v0 - view.from, b = triangle.v1 - view.from, c = triangle.v2 - view.from;
  const Vec3 normal = cross(b - a, c - a);
  const double height = dot(normal, a);
  if (height == 0) return true;  // seen edge-on, it hides nothing
  // Seen from behind (height > 0: the normal points away from the viewer) the edges turn the other way round.
  const double sign = height > 0 ? 1 : -1;
  DiscCover& cover = covers.emplace_back();
  cover.edges = {linear(cross(a, b), 0, view, sign), linear(cross(b, c), 0, view, sign),
                 linear(cross(c, a), 0, view, sign), linear(normal, view.is_infinite ? 0 : height, view, sign)};
  cover.edge_count = 4;
  return true;
}

bool append_cover(const geometry::SphereShape& sphere, const DiscView& view, std::vector<DiscCover>& covers) {
  return SphereCovers(view).append(SeenSphere(sphere, view.from, 0), covers);
}

SphereCovers::SphereCovers(const DiscView& view) : view_(view), plane_(view) {
  add_squared(
      1, view, [](const Vec3& d) { return d; }, squared_);
}

bool SphereCovers::append(const SeenSphere& sphere, std::vector<DiscCover>& covers) const {
  if (!(sphere.size < 1 - math::gamma(128))) return false;
  if (!view_.is_infinite && !plane_.is_behind(sphere.center, sphere.radius)) return false;
  DiscCover& cover = covers.emplace_back();
  // Nothing is cut off where all of the disc is in front, on the sphere's side.
  const Linear front = linear(sphere.center, 0, view_, 1);
  if (!(front.a > std::fabs(front.b) + std::fabs(front.c))) cover.edges[cover.edge_count++] = front;
  cover.is_round = true;
  // r²|d|² − |center × d|²
  Quadratic& q = cover.round;
  add_squared(
      -1, view_, [&](const Vec3& d) { return cross(sphere.center, d); }, q);
  const double r2 = sphere.radius * sphere.radius;
  q.a += r2 * squared_.a, q.b += r2 * squared_.b, q.c += r2 * squared_.c;
  q.d += r2 * squared_.d, q.e += r2 * squared_.e, q.f += r2 * squared_.f;
  return true;
}

bool append_cover(const geometry::PlaneShape& plane, const DiscView& view, std::vector<DiscCover>& covers) {
  const double height = dot(plane.normal, plane.point - view.from);
  DiscCover& cover = covers.emplace_back();
  cover.edges[cover.edge_count++] = linear(plane.normal, view.is_infinite ? 0 : height, view, height > 0 ? 1 : -1);
  return true;
}

bool append_cover(const geometry::CylinderShape& cylinder, const DiscView& view, std::vector<DiscCover>& covers) {
  if (!cylinder.caps) return false;
  const Vec3 base = cylinder.base - view.from, along = cylinder.axis * cylinder.height, top = base + along;
  const double to_base = dot(base, cylinder.axis), r = cylinder.radius;
  const Vec3 across = base - cylinder.axis * to_base;
  const double distance = math::length(across);
  const Vec3 reach = math::abs(base);
  const double size = reach.x + reach.y + reach.z + cylinder.height + r;
  const double margin = math::gamma(64) * size;
  const bool is_beside = distance > r + margin;
  const bool is_beyond = to_base > margin || to_base + cylinder.height < -margin;
  if (!is_beside && !is_beyond) return false;
  if (!view.is_infinite) {
    const DiscPlane plane(view);
    if (!plane.is_behind(base, r) || !plane.is_behind(top, r)) return false;
  }
  // What is seen is the hull of the two caps: the caps, and the quadrilateral between the lines where planes through
  // the point touch the side.
  if (std::fabs(to_base) > margin) append_disc(base, cylinder.axis, r, view, covers);
  if (std::fabs(to_base + cylinder.height) > margin) append_disc(top, cylinder.axis, r, view, covers);
  if (!is_beside) return true;
  const Vec3 towards = across * (-1 / distance), beside = cross(cylinder.axis, towards);
  const double cosine = r / distance, sine = std::sqrt((1 - cosine) * (1 + cosine));
  const Vec3 left = base + (towards * cosine + beside * sine) * r,
             right = base + (towards * cosine - beside * sine) * r;
  const std::array<Vec3, 4> corners{left, left + along, right + along, right};
  const double sign = dot(cross(corners[1] - corners[0], corners[3] - corners[0]), corners[0]) > 0 ? 1 : -1;
  DiscCover& cover = covers.emplace_back();
  for (std::size_t i = 0; i < 4; ++i) {
    cover.edges[cover.edge_count++] = linear(cross(corners[i], corners[(i + 1) % 4]), 0, view, sign);
  }
  return true;
}

DiscCover cover_below_horizon(const Vec3& facing, const DiscView& view) {
  DiscCover cover;
  cover.edges[cover.edge_count++] = linear(facing, 0, view, -1);
  return cover;
}

}  // namespace penumbra::shading::shadows
