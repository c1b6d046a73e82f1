#include "tests/bench/exact_hits.h"

#include <cmath>

#include "engine/math/constants.h"

namespace penumbra::bench {
namespace {

struct ExactRay {
  RTCIntersectContext context;  // first: Embree passes its address on
  Vec3 origin, direction;
  double least = 0, t = math::infinity;  // of the hit so far
  SurfaceHit hit;

  void offer(double distance, const Vec3& normal, std::uint32_t material) {
    if (!(distance > least) || distance >= t) return;
    t = distance;
    hit = {origin + direction * distance, normal, material};
  }
};

void meet(const FlatTriangle& triangle, ExactRay& ray) {
  // Möller and Trumbore, 1997.
  const Vec3 e1 = triangle.vertices[1] - triangle.vertices[0], e2 = triangle.vertices[2] - triangle.vertices[0];
  const Vec3 p = math::cross(ray.direction, e2);
  const double determinant = math::dot(e1, p);
  if (determinant == 0) return;
  const Vec3 s = ray.origin - triangle.vertices[0];
  const double b1 = math::dot(s, p) / determinant;
  if (b1 < 0 || b1 > 1) return;
  const Vec3 q = math::cross(s, e1);
  const double b2 = math::dot(ray.direction, q) / determinant;
  if (b2 < 0 || b1 + b2 > 1) return;
  ray.offer(math::dot(e2, q) / determinant, math::normalize(math::cross(e1, e2)), triangle.material);
}

void meet(const FlatSphere& sphere, ExactRay& ray) {
  const Vec3 f = sphere.center - ray.origin;
  const double b = math::dot(f, ray.direction);
  const Vec3 off = f - ray.direction * b;
  const double squared = sphere.radius * sphere.radius - math::dot(off, off);
  if (squared < 0) return;
  for (const double t : {b - std::sqrt(squared), b + std::sqrt(squared)}) {
    ray.offer(t, math::normalize(ray.origin + ray.direction * t - sphere.center), sphere.material);
  }
}

void meet(const FlatCylinder& cylinder, ExactRay& ray) {
  const Vec3 axis = math::normalize(cylinder.to - cylinder.from);
  const double height = math::length(cylinder.to - cylinder.from);
  const Vec3 across = ray.direction - axis * math::dot(ray.direction, axis);
  const Vec3 from = ray.origin - cylinder.from;
  const Vec3 off = from - axis * math::dot(from, axis);
  const double a = math::dot(across, across), b = math::dot(off, across);
  const double discriminant = b * b - a * (math::dot(off, off) - cylinder.radius * cylinder.radius);
  if (a == 0 || discriminant < 0) return;
  for (const double root : {-std::sqrt(discriminant), std::sqrt(discriminant)}) {
    const double t = (root - b) / a;
    const double along = math::dot(from + ray.direction * t, axis);
    if (along >= 0 && along <= height) ray.offer(t, math::normalize(off + across * t), cylinder.material);
  }
}

void box_of(const FlatTriangle& t, Vec3& lower, Vec3& upper) {
  lower = math::min(t.vertices[0], math::min(t.vertices[1], t.vertices[2]));
  upper = math::max(t.vertices[0], math::max(t.vertices[1], t.vertices[2]));
}
void box_of(const FlatSphere& s, Vec3& lower, Vec3& upper) {
  const Vec3 half{s.radius, s.radius, s.radius};
  lower = s.center - half, upper = s.center + half;
}
void box_of(const FlatCylinder& c, Vec3& lower, Vec3& upper) {
  const Vec3 half{c.radius, c.radius, c.radius};
  lower = math::min(c.from, c.to) - half, upper = math::max(c.from, c.to) + half;
}

template <class Shape>
void attach(RTCDevice device, RTCScene scene, const std::vector<Shape>& shapes) {
  if (shapes.empty()) return;
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(shapes.size()));
  rtcSetGeometryUserData(geometry, const_cast<std::vector<Shape>*>(&shapes));
  const auto bounds = [](const RTCBoundsFunctionArguments* arguments) {
    Vec3 lower, upper;
    box_of((*static_cast<const std::vector<Shape>*>(arguments->geometryUserPtr))[arguments->primID], lower, upper);
    // Wide enough for the rounding of a float ray that is none of its own.
    const double largest = math::max_component(math::max(math::abs(lower), math::abs(upper)));
    const double margin = 0x1p-17 * largest;
    RTCBounds& box = *arguments->bounds_o;
    box.lower_x = static_cast<float>(lower.x - margin), box.upper_x = static_cast<float>(upper.x + margin);
    box.lower_y = static_cast<float>(lower.y - margin), box.upper_y = static_cast<float>(upper.y + margin);
    box.lower_z = static_cast<float>(lower.z - margin), box.upper_z = static_cast<float>(upper.z + margin);
  };
  const auto intersect = [](const RTCIntersectFunctionNArguments* arguments) {
    auto& ray = *reinterpret_cast<ExactRay*>(arguments->context);
    meet((*static_cast<const std::vector<Shape>*>(arguments->geometryUserPtr))[arguments->primID], ray);
    if (ray.t < math::infinity) {
      auto* query = reinterpret_cast<RTCRayHit*>(arguments->rayhit);
      query->ray.tfar = static_cast<float>(ray.t * (1 + 0x1p-20));
    }
  };
  rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, intersect);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
}

}  // namespace

ExactHits::ExactHits(const FlatScene& flat)
    : flat_(flat), device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  attach(device_, scene_, flat_.triangles);
  attach(device_, scene_, flat_.spheres);
  attach(device_, scene_, flat_.cylinders);
  rtcCommitScene(scene_);
}

ExactHits::~ExactHits() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

std::optional<SurfaceHit> ExactHits::closest(const Vec3& origin, const Vec3& direction, double least) const {
  ExactRay ray;
  rtcInitIntersectContext(&ray.context);
  ray.origin = origin, ray.direction = direction, ray.least = least;
  RTCRayHit query{};
  query.ray.org_x = static_cast<float>(origin.x), query.ray.org_y = static_cast<float>(origin.y);
  query.ray.org_z = static_cast<float>(origin.z), query.ray.dir_x = static_cast<float>(direction.x);
  query.ray.dir_y = static_cast<float>(direction.y), query.ray.dir_z = static_cast<float>(direction.z);
  query.ray.tfar = math::float_infinity, query.ray.mask = ~0u;
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_, &ray.context, &query);
  if (ray.t == math::infinity) return std::nullopt;
  return ray.hit;
}

}  // namespace penumbra::bench
