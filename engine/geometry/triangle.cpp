#include "engine/geometry/triangle.h"

#include "engine/math/error_free.h"

namespace penumbra::geometry {
namespace {

using math::gamma;

/// A point exactly on the edge from (px, py) to (qx, qy) belongs to the triangle on the edge's left if the edge goes
/// up, or level to the right.
bool owns_edge(double px, double py, double qx, double qy, bool clockwise) {
  const double dx = clockwise ? px - qx : qx - px;
  const double dy = clockwise ? py - qy : qy - py;
  return dy > 0 || (dy == 0 && dx > 0);
}

}  // namespace

std::optional<TriangleHit> intersect(const TriangleVertices& triangle, const PreparedRay& ray, double limit) {
  const Vec3 a = triangle.v0 - ray.origin, b = triangle.v1 - ray.origin, c = triangle.v2 - ray.origin;
  const int kx = ray.axis_x, ky = ray.axis_y, kz = ray.axis_z;
  const double ax = a[kx] - ray.shear_x * a[kz], ay = a[ky] - ray.shear_y * a[kz];
  const double bx = b[kx] - ray.shear_x * b[kz], by = b[ky] - ray.shear_y * b[kz];
  const double cx = c[kx] - ray.shear_x * c[kz], cy = c[ky] - ray.shear_y * c[kz];
  const double u = math::signed_difference_of_products(cx, by, cy, bx);
  const double v = math::signed_difference_of_products(ax, cy, ay, cx);
  if ((u < 0 && v > 0) || (u > 0 && v < 0)) return std::nullopt;
  const double w = math::signed_difference_of_products(bx, ay, by, ax);
  if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return std::nullopt;
  const double determinant = u + v + w;
  if (!(determinant != 0)) return std::nullopt;
  if (u == 0 || v == 0 || w == 0) {
    // u = 2·area(b, c, ray) and so on: positive when the ray is to the right of b → c.
    const bool clockwise = determinant > 0;
    if (u == 0 && !owns_edge(bx, by, cx, cy, clockwise)) return std::nullopt;
    if (v == 0 && !owns_edge(cx, cy, ax, ay, clockwise)) return std::nullopt;
    if (w == 0 && !owns_edge(ax, ay, bx, by, clockwise)) return std::nullopt;
  }
  const double az = ray.shear_z * a[kz], bz = ray.shear_z * b[kz], cz = ray.shear_z * c[kz];
  const double inverse = 1 / determinant;
  const double t = (u * az + v * bz + w * cz) * inverse;
  if (!(t > 0 && t < limit)) return std::nullopt;
  // A hit closer than the rounding error of t may be an artefact: the origin lies on a neighbour of this triangle.
  // Error bounds of the products above, after PBR (4th ed.) section 6.8.7.
  const double max_x = std::max(std::fabs(ax), std::max(std::fabs(bx), std::fabs(cx)));
  const double max_y = std::max(std::fabs(ay), std::max(std::fabs(by), std::fabs(cy)));
  const double max_z = std::max(std::fabs(az), std::max(std::fabs(bz), std::fabs(cz)));
  const double depth = max_z * std::fabs(ray.direction[kz]);
  const double delta_x = gamma(5) * (max_x + depth), delta_y = gamma(5) * (max_y + depth), delta_z = gamma(3) * max_z;
  const double delta_e = 2 * (gamma(2) * max_x * max_y + delta_y * max_x + delta_x * max_y);
  const double max_e = std::max(std::fabs(u), std::max(std::fabs(v), std::fabs(w)));
  const double delta_t = 3 * (gamma(3) * max_e * max_z + delta_e * max_z + delta_z * max_e) * std::fabs(inverse);
  if (t <= delta_t) return std::nullopt;
  return TriangleHit{t, v * inverse, w * inverse};
}

Vec3 normal_of(const TriangleVertices& triangle) {
  const Vec3 e = triangle.v1 - triangle.v0, f = triangle.v2 - triangle.v0;
  const Vec3 n{math::difference_of_products(e.y, f.z, e.z, f.y), math::difference_of_products(e.z, f.x, e.x, f.z),
               math::difference_of_products(e.x, f.y, e.y, f.x)};
  return math::max_component(math::abs(n)) > 0 ? math::normalize(n) : Vec3{};
}

SurfacePoint point_on(const TriangleVertices& triangle, double b1, double b2) {
  const double b0 = 1 - b1 - b2;
  const Vec3 p0 = triangle.v0 * b0, p1 = triangle.v1 * b1, p2 = triangle.v2 * b2;
  SurfacePoint point;
  point.position = p0 + p1 + p2;
  // b0 = 1 − b1 − b2 carries its own rounding, so all three weights count with the size of their vertex.
  point.error = (math::abs(p0) + math::abs(p1) + math::abs(p2) + math::abs(triangle.v0)) * gamma(7);
  point.normal = normal_of(triangle);
  point.shading_normal = point.normal;
  return point;
}

}  // namespace penumbra::geometry
