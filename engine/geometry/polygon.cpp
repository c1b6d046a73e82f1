#include "engine/geometry/polygon.h"

#include "engine/math/error_free.h"

namespace penumbra::geometry {
namespace {

using math::Vec3;

struct Point2 {
  double x, y;
};

/// Twice the signed area of (a, b, c).
double area(const Point2& a, const Point2& b, const Point2& c) {
  return math::difference_of_products(b.x - a.x, c.y - a.y, b.y - a.y, c.x - a.x);
}

bool contains(const Point2& a, const Point2& b, const Point2& c, const Point2& p) {
  return area(a, b, p) >= 0 && area(b, c, p) >= 0 && area(c, a, p) >= 0;
}

/// Newell's normal: exact in direction even when some vertices are collinear.
Vec3 newell(const std::vector<Vec3>& v) {
  Vec3 n;
  for (std::size_t i = 0; i < v.size(); ++i) n += math::cross(v[i] - v[0], v[(i + 1) % v.size()] - v[0]);
  return n;
}

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate(const std::vector<Vec3>& vertices) {
  const Vec3 n = newell(vertices);
  const Vec3 size = math::abs(n);
  const int drop = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  int ix = (drop + 1) % 3, iy = (drop + 2) % 3;
  if (n[drop] < 0) std::swap(ix, iy);
  std::vector<Point2> p;
  p.reserve(vertices.size());
  for (const Vec3& v : vertices) p.push_back({v[ix], v[iy]});

  std::vector<std::uint32_t> rest(vertices.size());
  for (std::uint32_t i = 0; i < rest.size(); ++i) rest[i] = i;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  // Who is no ear stays none until a neighbour goes: what lies in the way is a reflex vertex, and no ear itself. Where
  // vertices touch that may fail, and everybody is asked again.
  std::vector<bool> is_known_blocked(vertices.size(), false);
  std::size_t at = 0, passed = 0, unasked = 0;  // since the last ear
  while (rest.size() > 3) {
    const std::size_t count = rest.size();
    if (passed == count) {
      if (unasked == 0) break;
      is_known_blocked.assign(vertices.size(), false);
      passed = unasked = 0;
    }
    const std::uint32_t a = rest[(at + count - 1) % count], b = rest[at], c = rest[(at + 1) % count];
    if (is_known_blocked[b]) {
      at = (at + 1) % count;
      ++passed, ++unasked;
      continue;
    }
    const double turn = area(p[a], p[b], p[c]);
    bool is_ear = turn > 0;
    for (std::size_t k = 2; is_ear && k + 1 < count; ++k) {
      const std::uint32_t q = rest[(at + k) % count];
      is_ear = !contains(p[a], p[b], p[c], p[q]);
    }
    if (is_ear || turn == 0) {
      if (is_ear) triangles.push_back({a, b, c});
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(at));
      is_known_blocked[a] = is_known_blocked[c] = false;
      at %= rest.size();
      passed = unasked = 0;
    } else {
      is_known_blocked[b] = true;
      at = (at + 1) % count;
      ++passed;
    }
  }
  // What is left is a triangle, or a remnant that rounding made unclippable: a fan covers it.
  for (std::size_t i = 2; i < rest.size(); ++i) triangles.push_back({rest[0], rest[i - 1], rest[i]});
  return triangles;
}

}  // namespace penumbra::geometry
