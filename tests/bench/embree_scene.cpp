#include "tests/bench/embree_scene.h"

#include <immintrin.h>

#include <chrono>
#include <stdexcept>
#include <string>

namespace penumbra::bench {
namespace {

float* put(float* to, const Vec3& v) {
  *to++ = static_cast<float>(v.x), *to++ = static_cast<float>(v.y), *to++ = static_cast<float>(v.z);
  return to;
}

float* new_vertices(RTCGeometry geometry, RTCFormat format, std::size_t floats_each, std::size_t count) {
  return static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, format, floats_each * sizeof(float), count));
}

void attach(RTCScene scene, RTCGeometry geometry, unsigned id) {
  rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

}  // namespace

EmbreeScene::EmbreeScene(const FlatScene& flat, const EmbreeSettings& settings)
    : device_(rtcNewDevice(("threads=" + std::to_string(settings.build_threads)).c_str())),
      scene_(rtcNewScene(device_)) {
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
  rtcSetSceneFlags(scene_, settings.is_robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
  const auto start = std::chrono::steady_clock::now();
  if (!flat.triangles.empty()) add_triangles(flat);
  if (!flat.spheres.empty()) add_spheres(flat);
  if (!flat.cylinders.empty()) add_cylinders(flat);
  rtcCommitScene(scene_);
  build_seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) throw std::runtime_error("Embree refused the scene");
}

EmbreeScene::~EmbreeScene() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

void EmbreeScene::add_triangles(const FlatScene& flat) {
  const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  const std::size_t count = flat.triangles.size();
  float* position = new_vertices(geometry, RTC_FORMAT_FLOAT3, 3, 3 * count);
  auto* index = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), count));
  for (std::size_t i = 0; i < count; ++i) {
    for (const Vec3& vertex : flat.triangles[i].vertices) position = put(position, vertex);
    for (unsigned corner = 0; corner < 3; ++corner) *index++ = static_cast<unsigned>(3 * i) + corner;
  }
  attach(scene_, geometry, triangles_id);
}

void EmbreeScene::add_spheres(const FlatScene& flat) {
  const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_SPHERE_POINT);
  float* to = new_vertices(geometry, RTC_FORMAT_FLOAT4, 4, flat.spheres.size());
  for (const FlatSphere& sphere : flat.spheres) {
    to = put(to, sphere.center);
    *to++ = static_cast<float>(sphere.radius);
  }
  attach(scene_, geometry, spheres_id);
}

void EmbreeScene::add_cylinders(const FlatScene& flat) {
  const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_CONE_LINEAR_CURVE);
  float* to = new_vertices(geometry, RTC_FORMAT_FLOAT4, 4, 2 * flat.cylinders.size());
  auto* index = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT,
                                                               sizeof(unsigned), flat.cylinders.size()));
  for (std::size_t i = 0; i < flat.cylinders.size(); ++i) {
    for (const Vec3& end : {flat.cylinders[i].from, flat.cylinders[i].to}) {
      to = put(to, end);
      *to++ = static_cast<float>(flat.cylinders[i].radius);
    }
    *index++ = static_cast<unsigned>(2 * i);
  }
  attach(scene_, geometry, cylinders_id);
}

FlushedDenormals::FlushedDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040); }
FlushedDenormals::~FlushedDenormals() { _mm_setcsr(saved_); }

}  // namespace penumbra::bench
