#include "api/polygon_rules.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/math/bounds.h"
#include "engine/math/error_free.h"

namespace penumbra::api {

namespace {

using math::Vec3;

struct Point {
  double x = 0, y = 0;
  bool operator==(const Point&) const = default;
};

/// An edge by its ends in the order of x, and which edge of the polygon it is.
struct Edge {
  Point left, right;
  double lower_y = 0, upper_y = 0;
  std::size_t index = 0;
};

/// Twice the area of the triangle (a, b, c), positive when counter-clockwise.
double turn(const Point& a, const Point& b, const Point& c) {
  return math::difference_of_products(b.x - a.x, c.y - a.y, b.y - a.y, c.x - a.x);
}

/// Twice the area vector of the polygon (Newell).
Vec3 area_vector(std::span<const Vec3> vertices) {
  Vec3 sum;
  for (std::size_t i = 1; i + 1 < vertices.size(); ++i) {
    sum += cross(vertices[i] - vertices[0], vertices[i + 1] - vertices[0]);
  }
  return sum;
}

/// Whether edges that share no vertex have a point in common.
bool touch(const Edge& a, const Edge& b) {
  const double b_left = turn(a.left, a.right, b.left), b_right = turn(a.left, a.right, b.right);
  const double a_left = turn(b.left, b.right, a.left), a_right = turn(b.left, b.right, a.right);
  const bool b_on_one_side = (b_left > 0 && b_right > 0) || (b_left < 0 && b_right < 0);
  const bool a_on_one_side = (a_left > 0 && a_right > 0) || (a_left < 0 && a_right < 0);
  // On one line, they touch because their boxes do, which the caller has seen to.
  return !a_on_one_side && !b_on_one_side;
}

bool runs_back(const std::vector<Point>& points) {
  const std::size_t n = points.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Point &a = points[i], &b = points[(i + 1) % n], &c = points[(i + 2) % n];
    const double along = (b.x - a.x) * (c.x - b.x) + (b.y - a.y) * (c.y - b.y);
    if (turn(a, b, c) == 0 && along < 0) return true;
  }
  return false;
}

/// Sweeps along x and compares the edges whose boxes meet.
bool crosses_itself(const std::vector<Point>& points) {
  const std::size_t n = points.size();
  std::vector<Edge> edges(n);
  for (std::size_t i = 0; i < n; ++i) {
    Point a = points[i], b = points[(i + 1) % n];
    if (b.x < a.x) std::swap(a, b);
    edges[i] = {a, b, std::min(a.y, b.y), std::max(a.y, b.y), i};
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return a.left.x < b.left.x; });
  for (std::size_t i = 0; i < n; ++i) {
    const Edge& a = edges[i];
    for (std::size_t j = i + 1; j < n && edges[j].left.x <= a.right.x; ++j) {
      const Edge& b = edges[j];
      if (b.lower_y > a.upper_y || b.upper_y < a.lower_y) continue;
      const bool share_a_vertex = (a.index + 1) % n == b.index || (b.index + 1) % n == a.index;
      if (!share_a_vertex && touch(a, b)) return true;
    }
  }
  return false;
}

}  // namespace

std::optional<PolygonFault> polygon_fault(std::span<const Vec3> vertices) {
  const std::size_t n = vertices.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (vertices[i] == vertices[(i + 1) % n]) return PolygonFault{(i + 1) % n, "must differ from its neighbours"};
  }
  math::Bounds bounds;
  for (const Vec3& vertex : vertices) bounds.include(vertex);
  // Everything below is relative to the polygon's size, but for less than a factor of two: divided by a power of two,
  // what lies on one line stays there.
  const Vec3 center = bounds.center();
  const double longest = max_component(bounds.extent()), size = std::ldexp(1.0, std::ilogb(longest));
  const double scaled_longest = longest / size;
  std::vector<Vec3> scaled(n);
  std::transform(vertices.begin(), vertices.end(), scaled.begin(), [&](const Vec3& v) {
    return Vec3{(v.x - center.x) / size, (v.y - center.y) / size, (v.z - center.z) / size};
  });

  const Vec3 area = area_vector(scaled);
  constexpr double smallest_area = 1e-12;
  if (!(length(area) > smallest_area * scaled_longest * scaled_longest))
    return PolygonFault{{}, "must enclose an area, and not cross itself"};
  const Vec3 normal = normalize(area);
  Vec3 centroid;
  for (const Vec3& vertex : scaled) centroid += vertex * (1 / static_cast<double>(n));
  const auto is_off_plane = [&](const Vec3& v) {
    return std::fabs(dot(normal, v - centroid)) > planarity_tolerance * scaled_longest;
  };
  if (std::any_of(scaled.begin(), scaled.end(), is_off_plane)) {
    return PolygonFault{{}, "must lie in one plane, to 1e-6 of the polygon's size"};
  }

  const Vec3 weight = abs(normal);
  const bool drop_x = weight.x >= weight.y && weight.x >= weight.z;
  const bool drop_y = !drop_x && weight.y >= weight.z;
  std::vector<Point> flat(n);
  std::transform(scaled.begin(), scaled.end(), flat.begin(), [&](const Vec3& v) {
    return Point{drop_x ? v.y : v.x, drop_x || drop_y ? v.z : v.y};
  });
  if (runs_back(flat) || crosses_itself(flat)) return PolygonFault{{}, "must not touch or cross itself"};
  return std::nullopt;
}

}  // namespace penumbra::api
