#include "tests/bench/exact_hits.h"

#include <cmath>

#include "engine/math/constants.h"
#include "tests/bench/embree_scene.h"

namespace penumbra::bench {
namespace {

constexpr unsigned first_instance = 3;  // Embree's geomID of it, after those of the shapes

struct ExactRay {
  RTCIntersectContext context;  // first: Embree passes its address on
  const FlatScene* flat;
  Vec3 origin, direction;                // as the shape is given: in an instance's mesh, those of the mesh
  double least = 0, t = math::infinity;  // of the hit so far
  SurfaceHit hit;
  bool is_new = false;

  bool is_nearer(double distance) const { return distance > least && distance < t; }
  void take(double distance, const SurfaceHit& met) { t = distance, hit = met, is_new = true; }
  void offer(double distance, const Vec3& normal, std::uint32_t material, double size) {
    if (is_nearer(distance)) take(distance, {origin + direction * distance, normal, normal, material, size});
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
  const double t = math::dot(e2, q) / determinant;
  if (ray.is_nearer(t)) ray.take(t, on_triangle(*ray.flat, triangle, b1, b2));
}

void meet(const FlatSphere& sphere, ExactRay& ray) {
  const Vec3 f = sphere.center - ray.origin;
  const double b = math::dot(f, ray.direction);
  const Vec3 off = f - ray.direction * b;
  const double squared = sphere.radius * sphere.radius - math::dot(off, off);
  if (squared < 0) return;
  for (const double t : {b - std::sqrt(squared), b + std::sqrt(squared)}) {
    ray.offer(t, math::normalize(ray.origin + ray.direction * t - sphere.center), sphere.material, size_of(sphere));
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
    if (along >= 0 && along <= height)
      ray.offer(t, math::normalize(off + across * t), cylinder.material, size_of(cylinder));
  }
}

/// In the space of the instance's mesh, if the triangle belongs to one: lengths along the ray stay the same.
void meet_placed(unsigned instance_id, const FlatTriangle& triangle, ExactRay& ray) {
  if (instance_id == RTC_INVALID_GEOMETRY_ID) return meet(triangle, ray);
  const FlatInstance& instance = ray.flat->instances[instance_id - first_instance];
  const Vec3 origin = ray.origin, direction = ray.direction;
  ray.origin = instance.to_mesh.point(origin), ray.direction = instance.to_mesh.vector(direction);
  ray.is_new = false;
  meet(triangle, ray);
  ray.origin = origin, ray.direction = direction;
  if (ray.is_new) ray.hit = placed(instance, ray.hit);
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

/// Wide enough for the rounding of a float ray that is none of the shape's own.
template <class Shape>
RTCBounds wide_box(const Shape& shape, double extent) {
  Vec3 lower, upper;
  box_of(shape, lower, upper);
  const double largest = std::max(extent, math::max_component(math::max(math::abs(lower), math::abs(upper))));
  const Vec3 margin = Vec3{1, 1, 1} * (0x1p-17 * largest);
  lower = lower - margin, upper = upper + margin;
  const auto narrow = [](double x) { return static_cast<float>(x); };
  return {narrow(lower.x), narrow(lower.y), narrow(lower.z), 0, narrow(upper.x), narrow(upper.y), narrow(upper.z), 0};
}

template <class Shape>
void intersect(const RTCIntersectFunctionNArguments* arguments) {
  auto& ray = *reinterpret_cast<ExactRay*>(arguments->context);
  const Shape& shape = (*static_cast<const ExactShapes<Shape>*>(arguments->geometryUserPtr)->list)[arguments->primID];
  if constexpr (std::is_same_v<Shape, FlatTriangle>) {
    meet_placed(arguments->context->instID[0], shape, ray);
  } else {
    meet(shape, ray);
  }
  if (ray.t < math::infinity) {
    auto* query = reinterpret_cast<RTCRayHit*>(arguments->rayhit);
    query->ray.tfar = static_cast<float>(ray.t * (1 + 0x1p-20));
  }
}

template <class Shape>
void attach(RTCDevice device, RTCScene scene, const ExactShapes<Shape>& shapes) {
  if (shapes.list->empty()) return;
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(shapes.list->size()));
  rtcSetGeometryUserData(geometry, const_cast<ExactShapes<Shape>*>(&shapes));
  const auto bounds = [](const RTCBoundsFunctionArguments* arguments) {
    const auto& given = *static_cast<const ExactShapes<Shape>*>(arguments->geometryUserPtr);
    *arguments->bounds_o = wide_box((*given.list)[arguments->primID], given.extent);
  };
  rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, intersect<Shape>);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
}

/// The largest coordinate of the scene, in the units of the instances' meshes.
double extent_in_meshes(const FlatScene& flat) {
  double extent = 0, scale = 0;
  for (const FlatTriangle& t : flat.triangles) {
    for (const Vec3& vertex : t.vertices) extent = std::max(extent, largest_coordinate(vertex));
  }
  for (const FlatInstance& instance : flat.instances) {
    extent = std::max(extent, largest_coordinate(instance.to_world.translation));
    for (const Vec3& column : instance.to_mesh.column) scale = std::max(scale, math::length(column));
  }
  return extent * scale;
}

}  // namespace

ExactHits::ExactHits(const FlatScene& flat)
    : flat_(flat),
      triangles_{&flat.triangles},
      spheres_{&flat.spheres},
      cylinders_{&flat.cylinders},
      device_(rtcNewDevice(nullptr)),
      scene_(rtcNewScene(device_)) {
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  attach(device_, scene_, triangles_);
  attach(device_, scene_, spheres_);
  attach(device_, scene_, cylinders_);
  for (const std::vector<FlatTriangle>& mesh : flat.meshes) meshes_.push_back({&mesh, extent_in_meshes(flat)});
  for (const ExactShapes<FlatTriangle>& mesh : meshes_) {
    mesh_scenes_.push_back(rtcNewScene(device_));
    rtcSetSceneFlags(mesh_scenes_.back(), RTC_SCENE_FLAG_ROBUST);
    attach(device_, mesh_scenes_.back(), mesh);
    rtcCommitScene(mesh_scenes_.back());
  }
  for (unsigned i = 0; i < flat.instances.size(); ++i)
    attach_instance(device_, scene_, mesh_scenes_[flat.instances[i].mesh], flat.instances[i].to_world,
                    first_instance + i);
  rtcCommitScene(scene_);
}

ExactHits::~ExactHits() {
  rtcReleaseScene(scene_);
  for (const RTCScene mesh : mesh_scenes_) rtcReleaseScene(mesh);
  rtcReleaseDevice(device_);
}

std::optional<SurfaceHit> ExactHits::closest(const Vec3& origin, const Vec3& direction, double least) const {
  ExactRay ray;
  rtcInitIntersectContext(&ray.context);
  ray.flat = &flat_, ray.origin = origin, ray.direction = direction, ray.least = least;
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
