#include "server/jobs/spec_hash.h"

#include <array>
#include <concepts>
#include <optional>
#include <variant>
#include <vector>

#include "api/version.h"
#include "server/store/sha256.h"

namespace penumbra::jobs {

namespace {

using namespace scene;

/// Writes values one after the other. What may be missing or has a length says so first, so that different requests
/// never give the same bytes. Structs are taken apart by structured bindings: one that gets another member no longer
/// compiles here.
class SpecHasher {
 public:
  void add(double value) { put(&value, sizeof value); }
  void add(std::integral auto value) {
    const auto wide = static_cast<std::uint64_t>(value);
    put(&wide, sizeof wide);
  }
  template <class Enum>
  requires std::is_enum_v<Enum>
  void add(Enum value) { add(static_cast<std::uint64_t>(value)); }
  template <class... Values>
  requires(sizeof...(Values) > 1) void add(const Values&... values) { (add(values), ...); }
  template <class Value>
  void add(const std::optional<Value>& value) {
    add(value.has_value());
    if (value) add(*value);
  }
  template <class Value>
  void add(const std::vector<Value>& values) {
    add(values.size());
    for (const Value& value : values) add(value);
  }
  template <class Value, std::size_t size>
  void add(const std::array<Value, size>& values) {
    for (const Value& value : values) add(value);
  }
  template <class... Kinds>
  void add(const std::variant<Kinds...>& value) {
    add(value.index());
    std::visit([this](const auto& kind) { add(kind); }, value);
  }

  void add(const math::Vec3& value) {
    const auto& [x, y, z] = value;
    add(x, y, z);
  }
  void add(const math::Color& value) {
    const auto& [r, g, b] = value;
    add(r, g, b);
  }
  void add(const math::Affine& value) {
    const auto& [columns, translation] = value;
    add(columns[0], columns[1], columns[2], translation);
  }

  void add(const ViewPlane& value) {
    const auto& [width, height, distance] = value;
    add(width, height, distance);
  }
  void add(const Lens& value) {
    const auto& [aperture_radius, focus_distance] = value;
    add(aperture_radius, focus_distance);
  }
  void add(const Camera& value) {
    const auto& [position, direction, up, view_plane, fov, projection, lens] = value;
    add(position, direction, up, view_plane, fov, projection, lens);
  }
  void add(const Material& value) {
    const auto& [emission, ambient, diffuse, specular, shininess, reflection, transmission, ior] = value;
    add(emission, ambient, diffuse, specular, shininess, reflection, transmission, ior);
  }

  void add(const Attenuation& value) {
    const auto& [constant, linear, quadratic] = value;
    add(constant, linear, quadratic);
  }
  void add(const PointLight& value) {
    const auto& [position, intensity, attenuation, radius] = value;
    add(position, intensity, attenuation, radius);
  }
  void add(const SpotLight& value) {
    const auto& [position, intensity, attenuation, radius, direction, exponent, cutoff] = value;
    add(position, intensity, attenuation, radius, direction, exponent, cutoff);
  }
  void add(const DirectionalLight& value) {
    const auto& [direction, intensity, angular_radius] = value;
    add(direction, intensity, angular_radius);
  }
  void add(const RectangleLight& value) {
    const auto& [corner, edge_u, edge_v, radiance] = value;
    add(corner, edge_u, edge_v, radiance);
  }
  void add(const SphereLight& value) {
    const auto& [center, radius, radiance] = value;
    add(center, radius, radiance);
  }

  void add(const Sphere& value) {
    const auto& [center, radius] = value;
    add(center, radius);
  }
  void add(const Plane& value) {
    const auto& [point, normal] = value;
    add(point, normal);
  }
  void add(const Triangle& value) {
    const auto& [vertices] = value;
    add(vertices);
  }
  void add(const Polygon& value) {
    const auto& [vertices] = value;
    add(vertices);
  }
  void add(const Tube& value) {
    const auto& [point, direction, radius] = value;
    add(point, direction, radius);
  }
  void add(const Cylinder& value) {
    const auto& [point, direction, radius, height, caps] = value;
    add(point, direction, radius, height, caps);
  }
  void add(const Mesh& value) {
    const auto& [positions, triangles, normals] = value;
    add(positions, triangles, normals);
  }
  void add(const Instance& value) {
    const auto& [mesh, transform] = value;
    add(mesh, transform);
  }
  void add(const Group& value) {
    const auto& [objects, transform] = value;
    add(objects, transform);
  }
  void add(const Object& value) {
    const auto& [shape, material] = value;
    add(shape, material);
  }
  void add(const Description& value) {
    [[maybe_unused]] const auto& [name, camera, background, ambient, materials, meshes, objects, lights] = value;
    add(camera, background, ambient, materials, meshes, objects, lights);
  }
  void add(const Options& value) {
    [[maybe_unused]] const auto& [width, height, samples, shadow_samples, target_error, time_budget_s, max_depth,
                                  min_contribution, threads, acceleration, seed, exposure, transfer, format, bit_depth,
                                  progress_interval_s, priority] = value;
    // The accelerations may differ in a level of a few pixels.
    add(width, height, samples, shadow_samples, target_error, max_depth, min_contribution, acceleration, seed, exposure,
        transfer, format, bit_depth);
  }

  std::string hex() {
    hash_.add(pending_.data(), pending_.size());
    return hash_.hex();
  }

 private:
  void put(const void* bytes, std::size_t size) {
    constexpr std::size_t at_once = 4096;
    pending_.append(static_cast<const char*>(bytes), size);
    if (pending_.size() < at_once) return;
    hash_.add(pending_.data(), pending_.size());
    pending_.clear();
  }

  store::Sha256 hash_;
  std::string pending_;
};

}  // namespace

std::string spec_hash(const api::JobRequest& request) {
  if (request.options.time_budget_s) return "";
  SpecHasher hasher;
  hasher.add(request.scene, request.options);
  return hasher.hex();
}

std::string engine_version() { return std::string(api::version()) + "-" + std::string(api::engine_hash()); }

}  // namespace penumbra::jobs
