#include "tests/bench/embree_scene.h"

#include <immintrin.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

namespace penumbra::bench {
namespace {

float* put(float* to, const Vec3& v) {
  *to++ = static_cast<float>(v.x), *to++ = static_cast<float>(v.y), *to++ = static_cast<float>(v.z);
  return to;
}

template <class Value>
Value* new_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::size_t values_each,
                  std::size_t count) {
  return static_cast<Value*>(rtcSetNewGeometryBuffer(geometry, type, 0, format, values_each * sizeof(Value), count));
}

}  // namespace

void attach_instance(RTCDevice device, RTCScene scene, RTCScene mesh, const math::Affine& to_world, unsigned id) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, mesh);
  float columns[12], *to = columns;
  for (const Vec3& column : {to_world.column[0], to_world.column[1], to_world.column[2], to_world.translation})
    to = put(to, column);
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

EmbreeScene::EmbreeScene(const FlatScene& flat, const std::vector<scene::Material>& materials,
                         const EmbreeSettings& settings)
    : flat_(flat),
      materials_(materials),
      device_(rtcNewDevice(("threads=" + std::to_string(settings.build_threads)).c_str())),
      scene_(rtcNewScene(device_)),
      flags_(settings.is_robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE) {
  sort(flat.triangles, FlatKind::triangle);
  sort(flat.spheres, FlatKind::sphere);
  sort(flat.cylinders, FlatKind::cylinder);
  for (const Part& part : parts_) is_opaque_ = is_opaque_ && !(part.is_transparent && !part.members.empty());
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
  rtcSetSceneFlags(scene_, flags_);
  const auto start = std::chrono::steady_clock::now();
  for (unsigned id = 0; id < part_count; ++id) {
    const Part& part = parts_[id];
    if (part.members.empty()) continue;
    if (part.kind == FlatKind::triangle) add_triangles(part, id);
    if (part.kind == FlatKind::sphere) add_spheres(part, id);
    if (part.kind == FlatKind::cylinder) add_cylinders(part, id);
  }
  add_instances();
  rtcCommitScene(scene_);
  build_seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  RTCBounds bounds;
  rtcGetSceneBounds(scene_, &bounds);
  for (const float coordinate :
       {bounds.lower_x, bounds.lower_y, bounds.lower_z, bounds.upper_x, bounds.upper_y, bounds.upper_z}) {
    nudge_ = std::max(nudge_, 0x1p-20 * std::fabs(static_cast<double>(coordinate)));
  }
  if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) throw std::runtime_error("Embree refused the scene");
}

EmbreeScene::~EmbreeScene() {
  rtcReleaseScene(scene_);
  for (const RTCScene mesh : meshes_) rtcReleaseScene(mesh);
  rtcReleaseDevice(device_);
}

FlatId EmbreeScene::flat_id(unsigned geometry, unsigned primitive) const {
  return {parts_[geometry].kind, parts_[geometry].members[primitive]};
}

template <class Shapes>
void EmbreeScene::sort(const Shapes& shapes, FlatKind kind) {
  for (const bool is_transparent : {false, true}) {
    Part& part = parts_[2 * static_cast<std::size_t>(kind) + is_transparent];
    part.scene = this, part.kind = kind, part.is_transparent = is_transparent;
    for (std::uint32_t i = 0; i < shapes.size(); ++i) {
      const bool transmits = !materials_.empty() && !math::is_black(materials_[shapes[i].material].transmission);
      if (transmits == is_transparent) part.members.push_back(i);
    }
  }
}

void EmbreeScene::attach(RTCGeometry geometry, const Part& part, unsigned id) {
  rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
  if (part.is_transparent) {
    rtcSetGeometryUserData(geometry, const_cast<Part*>(&part));
    rtcSetGeometryOccludedFilterFunction(geometry, let_through);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene_, geometry, id);
  rtcReleaseGeometry(geometry);
}

void EmbreeScene::let_through(const RTCFilterFunctionNArguments* arguments) {
  const Part& part = *static_cast<const Part*>(arguments->geometryUserPtr);
  auto* shadow = reinterpret_cast<ShadowContext*>(arguments->context);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] != -1) continue;
    arguments->valid[i] = 0;
    const unsigned primitive = RTCHitN_primID(arguments->hit, arguments->N, i);
    const unsigned lane = RTCRayN_id(arguments->ray, arguments->N, i);
    const float t = RTCRayN_tfar(arguments->ray, arguments->N, i);
    if (!shadow->passed[lane].is_new({&part, primitive, t})) continue;
    const std::uint32_t material = part.scene->material_of({part.kind, part.members[primitive]});
    const scene::Color& transmission = part.scene->materials_[material].transmission;
    shadow->transmittance[0][lane] *= static_cast<float>(transmission.r);
    shadow->transmittance[1][lane] *= static_cast<float>(transmission.g);
    shadow->transmittance[2][lane] *= static_cast<float>(transmission.b);
  }
}

std::uint32_t EmbreeScene::material_of(const FlatId& id) const {
  if (id.kind == FlatKind::triangle) return flat_.triangles[id.index].material;
  return id.kind == FlatKind::sphere ? flat_.spheres[id.index].material : flat_.cylinders[id.index].material;
}

RTCGeometry EmbreeScene::new_triangles(const FlatTriangle* triangles, const std::vector<std::uint32_t>& members) {
  const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  const std::size_t count = members.size();
  auto* position = new_buffer<float>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, 3, 3 * count);
  auto* index = new_buffer<unsigned>(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, 3, count);
  for (const std::uint32_t member : members) {
    for (const Vec3& vertex : triangles[member].vertices) position = put(position, vertex);
  }
  for (unsigned i = 0; i < 3 * count; ++i) *index++ = i;
  return geometry;
}

void EmbreeScene::add_triangles(const Part& part, unsigned id) {
  attach(new_triangles(flat_.triangles.data(), part.members), part, id);
}

void EmbreeScene::add_instances() {
  for (const std::vector<FlatTriangle>& triangles : flat_.meshes) {
    std::vector<std::uint32_t> all(triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    const RTCScene mesh = meshes_.emplace_back(rtcNewScene(device_));
    rtcSetSceneBuildQuality(mesh, RTC_BUILD_QUALITY_HIGH);
    rtcSetSceneFlags(mesh, flags_);
    const RTCGeometry geometry = new_triangles(triangles.data(), all);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(mesh, geometry, 0);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(mesh);
  }
  for (unsigned i = 0; i < flat_.instances.size(); ++i)
    attach_instance(device_, scene_, meshes_[flat_.instances[i].mesh], flat_.instances[i].to_world, part_count + i);
}

void EmbreeScene::add_spheres(const Part& part, unsigned id) {
  const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_SPHERE_POINT);
  auto* to = new_buffer<float>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, 4, part.members.size());
  for (const std::uint32_t member : part.members) {
    to = put(to, flat_.spheres[member].center);
    *to++ = static_cast<float>(flat_.spheres[member].radius);
  }
  attach(geometry, part, id);
}

void EmbreeScene::add_cylinders(const Part& part, unsigned id) {
  // Rounded ends, inside other objects; Embree's flat-ended cones hide themselves from rays that leave them.
  const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
  const std::size_t count = part.members.size();
  auto* to = new_buffer<float>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, 4, 2 * count);
  auto* index = new_buffer<unsigned>(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, 1, count);
  unsigned first = 0;
  for (const std::uint32_t member : part.members) {
    const FlatCylinder& cylinder = flat_.cylinders[member];
    for (const Vec3& end : {cylinder.from, cylinder.to}) {
      to = put(to, end);
      *to++ = static_cast<float>(cylinder.radius);
    }
    *index++ = first;
    first += 2;
  }
  attach(geometry, part, id);
}

FlushedDenormals::FlushedDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040); }
FlushedDenormals::~FlushedDenormals() { _mm_setcsr(saved_); }

}  // namespace penumbra::bench
