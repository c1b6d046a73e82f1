#include "engine/geometry/triangle.h"

#include "engine/math/constants.h"
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

/// The vertices relative to the ray's origin, sheared so that the ray runs along z.
struct Sheared {
  double x[3], y[3], z[3];

  Sheared(const TriangleVertices& triangle, const PreparedRay& ray) {
    const int kx = ray.axis_x, ky = ray.axis_y, kz = ray.axis_z;
    const double o[3]{ray.origin.x, ray.origin.y, ray.origin.z};
    const double v[3][3]{{triangle.v0.x, triangle.v0.y, triangle.v0.z},
                         {triangle.v1.x, triangle.v1.y, triangle.v1.z},
                         {triangle.v2.x, triangle.v2.y, triangle.v2.z}};
    for (int i = 0; i < 3; ++i) {
      z[i] = v[i][kz] - o[kz];
      x[i] = (v[i][kx] - o[kx]) - ray.shear_x * z[i];
      y[i] = (v[i][ky] - o[ky]) - ray.shear_y * z[i];
    }
  }

  /// From the edge functions u, v and w.
  TriangleHit hit(double u, double v, double w, const PreparedRay& ray) const {
    const double inverse = 1 / (u + v + w);
    const double t = (u * (ray.shear_z * z[0]) + v * (ray.shear_z * z[1]) + w * (ray.shear_z * z[2])) * inverse;
    return {t, v * inverse, w * inverse};
  }

  /// A bound, after PBR (4th ed.) section 6.8.7.
  double error_of_t(double u, double v, double w, const PreparedRay& ray) const {
    const auto largest = [](const double* c) {
      return std::max(std::fabs(c[0]), std::max(std::fabs(c[1]), std::fabs(c[2])));
    };
    const double max_x = largest(x), max_y = largest(y), depth = largest(z), max_z = std::fabs(ray.shear_z) * depth;
    const double delta_x = gamma(5) * (max_x + depth), delta_y = gamma(5) * (max_y + depth), delta_z = gamma(3) * max_z;
    const double delta_e = 2 * (gamma(2) * max_x * max_y + delta_y * max_x + delta_x * max_y);
    const double max_e = std::max(std::fabs(u), std::max(std::fabs(v), std::fabs(w)));
    return 3 * (gamma(3) * max_e * max_z + delta_e * max_z + delta_z * max_e) * std::fabs(1 / (u + v + w));
  }
};

}  // namespace

std::optional<TriangleHit> intersect(const TriangleVertices& triangle, const PreparedRay& ray, double limit) {
  const Sheared s(triangle, ray);
  const double u = math::signed_difference_of_products(s.x[2], s.y[1], s.y[2], s.x[1]);
  const double v = math::signed_difference_of_products(s.x[0], s.y[2], s.y[0], s.x[2]);
  if ((u < 0 && v > 0) || (u > 0 && v < 0)) return std::nullopt;
  const double w = math::signed_difference_of_products(s.x[1], s.y[0], s.y[1], s.x[0]);
  if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return std::nullopt;
  const double determinant = u + v + w;
  if (!(determinant != 0)) return std::nullopt;
  if (u == 0 || v == 0 || w == 0) {
    // u = 2·area(b, c, ray) and so on: positive when the ray is to the right of b → c.
    const bool clockwise = determinant > 0;
    if (u == 0 && !owns_edge(s.x[1], s.y[1], s.x[2], s.y[2], clockwise)) return std::nullopt;
    if (v == 0 && !owns_edge(s.x[2], s.y[2], s.x[0], s.y[0], clockwise)) return std::nullopt;
    if (w == 0 && !owns_edge(s.x[0], s.y[0], s.x[1], s.y[1], clockwise)) return std::nullopt;
  }
  const TriangleHit hit = s.hit(u, v, w, ray);
  if (!(hit.t > 0 && hit.t < limit)) return std::nullopt;
  // A hit closer than the rounding error of t may be an artefact: the origin lies on a neighbour of this triangle.
  if (hit.t <= s.error_of_t(u, v, w, ray)) return std::nullopt;
  return hit;
}

double error_of_t(const TriangleVertices& triangle, const PreparedRay& ray) {
  const Sheared s(triangle, ray);
  return s.error_of_t(s.x[2] * s.y[1] - s.y[2] * s.x[1], s.x[0] * s.y[2] - s.y[0] * s.x[2],
                      s.x[1] * s.y[0] - s.y[1] * s.x[0], ray);
}

bool crosses(const TriangleVertices& triangle, const PreparedRay& ray, double limit) {
  if (!intersect(triangle, ray, limit)) return false;
  if (limit == math::infinity) return true;
  const double rounding = ray.rounding + rounding_of_end(ray.origin, ray.direction, limit);
  return TrianglePlane(triangle).side(ray.origin + ray.direction * limit, rounding) != 0;
}

TriangleHit intersect_certainly(const TriangleVertices& triangle, const PreparedRay& ray) {
  const Sheared s(triangle, ray);
  return s.hit(s.x[2] * s.y[1] - s.y[2] * s.x[1], s.x[0] * s.y[2] - s.y[0] * s.x[2], s.x[1] * s.y[0] - s.y[1] * s.x[0],
               ray);
}

Vec3 normal_of(const TriangleVertices& triangle) {
  const Vec3 e = triangle.v1 - triangle.v0, f = triangle.v2 - triangle.v0;
  const Vec3 n{math::difference_of_products(e.y, f.z, e.z, f.y), math::difference_of_products(e.z, f.x, e.x, f.z),
               math::difference_of_products(e.x, f.y, e.y, f.x)};
  return math::normalize_or(n, {});
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
