#include "tests/bench/embree_shadows.h"

#include <algorithm>

#include "engine/math/constants.h"

namespace penumbra::bench {
namespace {

Vec3 normal_of(const FlatTriangle& t) {
  return math::normalize(math::cross(t.vertices[1] - t.vertices[0], t.vertices[2] - t.vertices[0]));
}

SurfaceHit on_sphere(const FlatSphere& sphere, const Vec3& near) {
  const Vec3 normal = math::normalize(near - sphere.center);
  return {sphere.center + normal * sphere.radius, normal, sphere.material};
}

SurfaceHit on_cylinder(const FlatCylinder& cylinder, const Vec3& near) {
  const Vec3 axis = math::normalize(cylinder.to - cylinder.from);
  const Vec3 on_axis = cylinder.from + axis * math::dot(near - cylinder.from, axis);
  const Vec3 normal = math::normalize(near - on_axis);
  return {on_axis + normal * cylinder.radius, normal, cylinder.material};
}

/// The three calls differ in name and type only.
template <int width>
struct Packet;
template <>
struct Packet<1> {
  struct Rays {
    alignas(64) RTCRay ray;
    float& tfar(int) { return ray.tfar; }
    void set(int, float ox, float oy, float oz, float dx, float dy, float dz) {
      ray.org_x = ox, ray.org_y = oy, ray.org_z = oz, ray.dir_x = dx, ray.dir_y = dy, ray.dir_z = dz;
      ray.tnear = ray.time = 0, ray.tfar = 1, ray.mask = ~0u, ray.id = 0, ray.flags = 0;
    }
  };
  static void occluded(const int* valid, RTCScene scene, RTCIntersectContext* context, Rays& rays) {
    if (*valid) rtcOccluded1(scene, context, &rays.ray);
  }
};
template <class Ray>
struct WideRays {
  Ray rays;
  float& tfar(int i) { return rays.tfar[i]; }
  void set(int i, float ox, float oy, float oz, float dx, float dy, float dz) {
    rays.org_x[i] = ox, rays.org_y[i] = oy, rays.org_z[i] = oz, rays.dir_x[i] = dx, rays.dir_y[i] = dy;
    rays.dir_z[i] = dz, rays.tnear[i] = rays.time[i] = 0, rays.tfar[i] = 1, rays.mask[i] = ~0u;
    rays.id[i] = static_cast<unsigned>(i), rays.flags[i] = 0;
  }
};
template <>
struct Packet<8> {
  using Rays = WideRays<RTCRay8>;
  static void occluded(const int* valid, RTCScene scene, RTCIntersectContext* context, Rays& rays) {
    rtcOccluded8(valid, scene, context, &rays.rays);
  }
};
template <>
struct Packet<16> {
  using Rays = WideRays<RTCRay16>;
  static void occluded(const int* valid, RTCScene scene, RTCIntersectContext* context, Rays& rays) {
    rtcOccluded16(valid, scene, context, &rays.rays);
  }
};

struct FloatVec {
  float x, y, z;
  explicit FloatVec(const Vec3& v)
      : x(static_cast<float>(v.x)), y(static_cast<float>(v.y)), z(static_cast<float>(v.z)) {}
};

template <int width>
ShadowSum cast(const EmbreeScene& embree, const DiscTarget& target, const float* x, const float* y, int count) {
  const FloatVec origin(target.origin), axis(target.axis), u(target.u), v(target.v);
  ShadowContext shadow;
  rtcInitIntersectContext(&shadow.context);
  shadow.context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  typename Packet<width>::Rays rays;
  alignas(64) int valid[width];
  float sum[3]{};
  const bool is_opaque = embree.is_opaque();
  float least = 1, most = 0;
  for (int first = 0; first < count; first += width) {
    const int used = std::min(width, count - first);
    for (int i = 0; i < width; ++i) {
      valid[i] = i < used ? -1 : 0;
      const int k = first + std::min(i, used - 1);
      rays.set(i, origin.x, origin.y, origin.z, axis.x + u.x * x[k] + v.x * y[k], axis.y + u.y * x[k] + v.y * y[k],
               axis.z + u.z * x[k] + v.z * y[k]);
    }
    if (!is_opaque) shadow.clear();
    Packet<width>::occluded(valid, embree.scene(), &shadow.context, rays);
    for (int i = 0; i < used; ++i) {
      const bool is_hidden = rays.tfar(i) < 0;
      for (int channel = 0; channel < 3; ++channel) {
        const float passed = is_hidden ? 0 : is_opaque ? 1 : shadow.transmittance[channel][i];
        sum[channel] += passed;
        least = std::min(least, passed), most = std::max(most, passed);
        if (is_opaque) break;
      }
    }
  }
  if (is_opaque) sum[1] = sum[2] = sum[0];
  return {{static_cast<double>(sum[0]), static_cast<double>(sum[1]), static_cast<double>(sum[2])}, least != most};
}

}  // namespace

std::optional<SurfaceHit> closest_with_embree(const EmbreeScene& embree, const FlatScene& flat, const Vec3& origin,
                                              const Vec3& direction) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  RTCRayHit query;
  const FloatVec from(origin), along(direction);
  query.ray = {from.x, from.y, from.z, 0, along.x, along.y, along.z, 0, math::float_infinity, ~0u, 0, 0};
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(embree.scene(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const FlatId id = embree.flat_id(query.hit.geomID, query.hit.primID);
  if (id.kind == FlatKind::triangle) {
    const FlatTriangle& t = flat.triangles[id.index];
    const double b1 = static_cast<double>(query.hit.u), b2 = static_cast<double>(query.hit.v);
    const Vec3 position = t.vertices[0] + (t.vertices[1] - t.vertices[0]) * b1 + (t.vertices[2] - t.vertices[0]) * b2;
    return SurfaceHit{position, normal_of(t), t.material};
  }
  const Vec3 near = origin + direction * static_cast<double>(query.ray.tfar);
  return id.kind == FlatKind::sphere ? on_sphere(flat.spheres[id.index], near)
                                     : on_cylinder(flat.cylinders[id.index], near);
}

Vec3 off_surface(const EmbreeScene& embree, const SurfaceHit& hit, const Vec3& towards) {
  return hit.position + hit.normal * std::copysign(embree.nudge(), math::dot(hit.normal, towards));
}

ShadowSum cast_shadow_rays(const EmbreeScene& embree, const DiscTarget& target, const float* x, const float* y,
                           int count, int width) {
  if (width == 1) return cast<1>(embree, target, x, y, count);
  return width == 8 ? cast<8>(embree, target, x, y, count) : cast<16>(embree, target, x, y, count);
}

}  // namespace penumbra::bench
