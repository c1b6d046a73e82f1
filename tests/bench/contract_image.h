#pragma once
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/math/constants.h"
#include "engine/scene/description.h"
#include "tests/bench/contract_lights.h"
#include "tests/bench/surface_hit.h"

namespace penumbra::bench {

using math::Color;

/// Camera rays as the contract's section 1 places them, without a lens. `direction` is unit.
class PinholeCamera {
 public:
  PinholeCamera(const scene::Camera& camera, int width, int height);
  Vec3 position() const { return position_; }
  Vec3 direction(int column, int row) const;

 private:
  Vec3 position_, corner_, step_right_, step_down_;
};

/// Section 2 of the contract, written down once more, for `ior` 1. `Queries` answers
///   std::optional<SurfaceHit> closest(origin, direction)
///   Color visibility(hit, facing, axis, u, v, share, place): the mean transmittance over the disc around hit + axis
///     with half-axes u and v (one ray where they are 0); `share` is what the light adds to the image at most, `place`
///     names the (pixel, path, light)
///   Color irradiance(hit, facing, light, place): the integral of transmittance · |n·l| over the solid angle in which
///     the area light is seen in front of the surface
///   Vec3 leave(hit, direction): an origin beside the surface
template <class Queries>
class ContractImage {
 public:
  ContractImage(const scene::Description& description, const ContractLights& lights, Queries& queries)
      : description_(description),
        lights_(lights),
        queries_(queries),
        places_(std::max<std::uint64_t>(64, std::bit_ceil(lights.discs.size() + lights.areas.size()))) {}

  Color radiance(const Vec3& origin, const Vec3& direction, std::uint64_t place) {
    return radiance(origin, direction, 0, math::white, place);
  }

 private:
  static constexpr int max_depth = 10;
  static constexpr double min_contribution = 0.001;

  Color radiance(const Vec3& origin, const Vec3& v, int depth, const Color& weight, std::uint64_t place) {
    const std::optional<SurfaceHit> hit = queries_.closest(origin, v);
    if (!hit) return description_.background;
    const scene::Material& material = description_.materials[hit->material];
    const Vec3 facing = math::dot(hit->normal, v) > 0 ? -hit->normal : hit->normal;
    Color result = material.emission;
    if (depth == 0) result += description_.ambient * material.ambient;
    std::uint64_t light_place = places_ * place;
    for (const scene::SpotLight& light : lights_.discs) result += lit_by(light, *hit, facing, v, weight, light_place++);
    for (const AreaLight& light : lights_.areas) result += lit_by(light, *hit, facing, light_place++);
    if (depth == max_depth) return result;
    const auto follow = [&](const Color& factor, const Vec3& direction, std::uint64_t path) {
      const Color path_weight = weight * factor;
      if (math::is_black(factor) || math::max_channel(path_weight) < min_contribution) return;
      result += factor * radiance(queries_.leave(*hit, direction), direction, depth + 1, path_weight, 3 * place + path);
    };
    const Vec3& n = hit->shading_normal;
    follow(material.reflection, v - n * (2 * math::dot(v, n)), 1);
    follow(material.transmission, v, 2);
    return result;
  }

  Color lit_by(const AreaLight& light, const SurfaceHit& hit, const Vec3& facing, std::uint64_t place) {
    const Color radiance = std::visit([](const auto& l) { return l.radiance; }, light);
    const Color share = radiance * description_.materials[hit.material].diffuse * (1 / math::pi);
    return math::is_black(share) ? math::black : share * queries_.irradiance(hit, facing, light, place);
  }

  Color lit_by(const scene::SpotLight& light, const SurfaceHit& hit, const Vec3& facing, const Vec3& v,
               const Color& weight, std::uint64_t place) {
    const scene::Material& material = description_.materials[hit.material];
    const Vec3 axis = light.position - hit.position;
    if (math::dot(facing, axis) <= 0) return math::black;
    const double distance = math::length(axis);
    const Vec3 l = axis * (-1 / distance);
    const auto& [c, linear, quadratic] = light.attenuation;
    double strength = 1 / (c + linear * distance + quadratic * distance * distance);
    if (light.cutoff_degrees < 180) {
      const double cosine = math::dot(light.direction, l);
      if (cosine < std::cos(light.cutoff_degrees * (M_PI / 180))) return math::black;
      strength *= std::pow(std::clamp(cosine, 0.0, 1.0), light.exponent);
    }
    const Vec3& n = hit.shading_normal;
    Color lobe = material.diffuse * std::fabs(math::dot(l, n));
    if (!math::is_black(material.specular)) {
      const Vec3 r = l - n * (2 * math::dot(l, n));
      lobe += material.specular * std::pow(std::clamp(-math::dot(v, r), 0.0, 1.0), material.shininess);
    }
    const Color share = light.intensity * lobe * strength;
    if (math::is_black(share)) return math::black;
    const math::Frame frame = math::frame_around(l);
    return share * queries_.visibility(hit, facing, axis, frame.u * light.radius, frame.v * light.radius,
                                       math::max_channel(weight * share), place);
  }

  const scene::Description& description_;
  const ContractLights& lights_;
  Queries& queries_;
  std::uint64_t places_;  // of the lights, for each of a path
};

}  // namespace penumbra::bench
