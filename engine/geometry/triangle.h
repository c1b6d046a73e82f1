#pragma once
#include <optional>

#include "engine/geometry/ray.h"
#include "engine/geometry/surface.h"

namespace penumbra::geometry {

/// A ray with the constants of the shear that makes its direction the z axis, after Woop, Benthin, Wald, "Watertight
/// Ray/Triangle Intersection", JCGT 2(1), 2013; and the reciprocals the slab test needs.
struct PreparedRay {
  Vec3 origin, direction, inverse;
  double rounding =
      0;  // of the coordinates of origin and direction, beyond their own: of a ray taken into a local space
  double shear_x = 0, shear_y = 0, shear_z = 0;
  int axis_x = 0, axis_y = 1, axis_z = 2;

  PreparedRay() = default;
  PreparedRay(const Vec3& from, const Vec3& towards) : origin(from), direction(towards) {
    const double d[3]{towards.x, towards.y, towards.z};
    const double reciprocal[3]{1 / d[0], 1 / d[1], 1 / d[2]};
    inverse = {reciprocal[0], reciprocal[1], reciprocal[2]};
    const Vec3 size = math::abs(towards);
    axis_z = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    axis_x = axis_z == 2 ? 0 : axis_z + 1;
    axis_y = axis_x == 2 ? 0 : axis_x + 1;
    shear_z = reciprocal[axis_z];
    shear_x = d[axis_x] * shear_z;
    shear_y = d[axis_y] * shear_z;
  }
};

struct TriangleVertices {
  Vec3 v0, v1, v2;
};

/// The plane of a triangle and which side of it a point lies on – beyond the rounding of all that takes part, or on
/// none: what lies in the plane is neither before nor behind it, and sees the triangle edge-on. Always the same answer
/// for one triangle and point, whoever asks.
struct TrianglePlane {
  Vec3 origin, normal;  // not unit
  double size, span;    // bounds: of the vertices' coordinates, of the edges; in taxicab lengths

  explicit TrianglePlane(const TriangleVertices& t) : origin(t.v0) {
    const Vec3 e = t.v1 - t.v0, f = t.v2 - t.v0;
    normal = math::cross(e, f);
    span = math::taxicab(e) + math::taxicab(f);
    size = math::taxicab(t.v0) + span;
  }
  /// What normal·(p − origin) may be off at a taxicab distance from the origin, with p off by `rounding`: coordinates
  /// are off by roundings of their size, also where they were given, and the normal by that times the edges' lengths.
  double error_at(double distance, double rounding) const {
    return span * (span + distance) * (math::gamma(16) * (size + distance) + rounding);
  }
  /// +1 where the triangle winds counter-clockwise as seen from there, −1 where it winds clockwise, 0 in the plane.
  int side(const Vec3& p, double rounding = 0) const {
    const Vec3 way = p - origin;
    return sign(math::dot(normal, way), error_at(math::taxicab(way), rounding));
  }
  /// The side that a direction leads to, from the plane.
  int side_towards(const Vec3& direction) const {
    return sign(math::dot(normal, direction), math::gamma(16) * span * size * math::taxicab(direction));
  }

 private:
  static int sign(double value, double error) { return value > error ? 1 : value < -error ? -1 : 0; }
};

/// Ray parameter and the weights of v1 and v2.
struct TriangleHit {
  double t, b1, b2;
};

/// Where the ray meets the triangle, either side, with 0 < t < limit (t beyond its own error bound). Watertight and
/// without double hits: the edge functions have exact signs, and a ray exactly through an edge or a vertex belongs to
/// one of the triangles around it, as in rasterisation.
std::optional<TriangleHit> intersect(const TriangleVertices& triangle, const PreparedRay& ray, double limit);

/// What t of a hit may be off by rounding.
double error_of_t(const TriangleVertices& triangle, const PreparedRay& ray);

/// Whether the segment from the ray's origin to t = limit crosses the triangle: a segment that ends in its plane does
/// not.
bool crosses(const TriangleVertices& triangle, const PreparedRay& ray, double limit);

/// The same hit as `intersect` finds where it is known to exist: strictly inside the triangle and far from t = 0,
/// beyond any rounding.
TriangleHit intersect_certainly(const TriangleVertices& triangle, const PreparedRay& ray);

/// The point with weights b1 and b2 of v1 and v2; `shading_normal` is the geometric one.
SurfacePoint point_on(const TriangleVertices& triangle, double b1, double b2);

/// Unit normal by winding; zero for a degenerate triangle.
Vec3 normal_of(const TriangleVertices& triangle);

}  // namespace penumbra::geometry
