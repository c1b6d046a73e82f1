#include "tests/bench/embree_shadows.h"

#include <algorithm>

#include "engine/math/constants.h"

namespace penumbra::bench {
namespace {

SurfaceHit on_sphere(const FlatSphere& sphere, const Vec3& near) {
  const Vec3 normal = math::normalize(near - sphere.center);
  return {sphere.center + normal * sphere.radius, normal, normal, sphere.material, size_of(sphere)};
}

SurfaceHit on_cylinder(const FlatCylinder& cylinder, const Vec3& near) {
  const Vec3 axis = math::normalize(cylinder.to - cylinder.from);
  const Vec3 on_axis = cylinder.from + axis * math::dot(near - cylinder.from, axis);
  const Vec3 normal = math::normalize(near - on_axis);
  return {on_axis + normal * cylinder.radius, normal, normal, cylinder.material, size_of(cylinder)};
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

FloatVec narrow(const Vec3& v) { return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)}; }

/// Rays to points of a disc: all of them count the same.
struct DiscRays {
  FloatVec axis, u, v;
  const float *x, *y;

  FloatVec direction(int k) const {
    return {axis.x + u.x * x[k] + v.x * y[k], axis.y + u.y * x[k] + v.y * y[k], axis.z + u.z * x[k] + v.z * y[k]};
  }
  static constexpr float weight(int) { return 1; }
};

struct AreaLanes {
  const float *x, *y, *z, *cosine;

  FloatVec direction(int k) const { return {x[k], y[k], z[k]}; }
  float weight(int k) const { return cosine[k]; }
};

template <int width, class Aim>
ShadowSum cast(const EmbreeScene& embree, const FloatVec& origin, const Aim& aim, int count) {
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
      const int k = first + std::min(i, used - 1);
      valid[i] = i < used && aim.weight(k) > 0 ? -1 : 0;
      const FloatVec to = aim.direction(k);
      rays.set(i, origin.x, origin.y, origin.z, to.x, to.y, to.z);
    }
    if (!is_opaque) shadow.clear();
    Packet<width>::occluded(valid, embree.scene(), &shadow.context, rays);
    for (int i = 0; i < used; ++i) {
      if (!valid[i]) continue;
      const bool is_hidden = rays.tfar(i) < 0;
      for (int channel = 0; channel < 3; ++channel) {
        const float passed = is_hidden ? 0 : is_opaque ? 1 : shadow.transmittance[channel][i];
        sum[channel] += passed * aim.weight(first + i);
        least = std::min(least, passed), most = std::max(most, passed);
        if (is_opaque) break;
      }
    }
  }
  if (is_opaque) sum[1] = sum[2] = sum[0];
  return {{static_cast<double>(sum[0]), static_cast<double>(sum[1]), static_cast<double>(sum[2])}, least < most};
}

template <class Aim>
ShadowSum cast(const EmbreeScene& embree, const Vec3& origin, const Aim& aim, int count, int width) {
  if (width == 1) return cast<1>(embree, narrow(origin), aim, count);
  return width == 8 ? cast<8>(embree, narrow(origin), aim, count) : cast<16>(embree, narrow(origin), aim, count);
}

}  // namespace

std::optional<SurfaceHit> closest_with_embree(const EmbreeScene& embree, const FlatScene& flat, const Vec3& origin,
                                              const Vec3& direction) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  RTCRayHit query;
  const FloatVec from = narrow(origin), along = narrow(direction);
  query.ray = {from.x, from.y, from.z, 0, along.x, along.y, along.z, 0, math::float_infinity, ~0u, 0, 0};
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(embree.scene(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const double b1 = static_cast<double>(query.hit.u), b2 = static_cast<double>(query.hit.v);
  if (query.hit.instID[0] != RTC_INVALID_GEOMETRY_ID) {
    const FlatInstance& instance = embree.instance(query.hit.instID[0]);
    return placed(instance, on_triangle(flat, flat.meshes[instance.mesh][query.hit.primID], b1, b2));
  }
  const FlatId id = embree.flat_id(query.hit.geomID, query.hit.primID);
  if (id.kind == FlatKind::triangle) return on_triangle(flat, flat.triangles[id.index], b1, b2);
  const Vec3 near = origin + direction * static_cast<double>(query.ray.tfar);
  return id.kind == FlatKind::sphere ? on_sphere(flat.spheres[id.index], near)
                                     : on_cylinder(flat.cylinders[id.index], near);
}

Vec3 off_surface(const SurfaceHit& hit, const Vec3& towards) {
  const double nudge = 0x1p-20 * std::max(hit.size, largest_coordinate(hit.position));
  return hit.position + hit.normal * std::copysign(nudge, math::dot(hit.normal, towards));
}

ShadowSum cast_shadow_rays(const EmbreeScene& embree, const DiscTarget& target, const float* x, const float* y,
                           int count, int width) {
  return cast(embree, target.origin, DiscRays{narrow(target.axis), narrow(target.u), narrow(target.v), x, y}, count,
              width);
}

ShadowSum cast_shadow_rays(const EmbreeScene& embree, const Vec3& origin, const RayLanes& rays, int first, int last,
                           int width) {
  const AreaLanes lanes{rays.x + first, rays.y + first, rays.z + first, rays.cosine + first};
  return cast(embree, origin, lanes, last - first, width);
}

}  // namespace penumbra::bench
