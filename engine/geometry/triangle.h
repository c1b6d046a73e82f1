#pragma once
#include <optional>

#include "engine/geometry/ray.h"
#include "engine/geometry/surface.h"

namespace penumbra::geometry {

/// A ray with the constants of the shear that makes its direction the z axis, after Woop, Benthin, Wald, "Watertight
/// Ray/Triangle Intersection", JCGT 2(1), 2013; and the reciprocals the slab test needs.
struct PreparedRay {
  Vec3 origin, direction, inverse;
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

/// Ray parameter and the weights of v1 and v2.
struct TriangleHit {
  double t, b1, b2;
};

/// Where the ray meets the triangle, either side, with 0 < t < limit (t beyond its own error bound). Watertight and
/// without double hits: the edge functions have exact signs, and a ray exactly through an edge or a vertex belongs to
/// one of the triangles around it, as in rasterisation.
std::optional<TriangleHit> intersect(const TriangleVertices& triangle, const PreparedRay& ray, double limit);

/// The same hit where it is known to exist: strictly inside the triangle and far from t = 0, beyond any rounding.
TriangleHit intersect_certainly(const TriangleVertices& triangle, const PreparedRay& ray);

/// The point with weights b1 and b2 of v1 and v2; `shading_normal` is the geometric one.
SurfacePoint point_on(const TriangleVertices& triangle, double b1, double b2);

/// Unit normal by winding; zero for a degenerate triangle.
Vec3 normal_of(const TriangleVertices& triangle);

}  // namespace penumbra::geometry
