#include "engine/render/compile_lights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <variant>

#include "engine/math/elementary.h"

namespace penumbra::render {
namespace {

using math::Vec3;

shading::Light compiled(const scene::PointLight& light) {
  return shading::DiscLight{light.position, light.intensity, light.attenuation, light.radius, false, {}, 0, 0};
}
shading::Light compiled(const scene::SpotLight& light) {
  return shading::DiscLight{light.position,
                            light.intensity,
                            light.attenuation,
                            light.radius,
                            true,
                            math::normalize(light.direction),
                            light.exponent,
                            math::sine_cosine_degrees(light.cutoff_degrees).cosine};
}
shading::Light compiled(const scene::DirectionalLight& light) {
  const auto [sine, cosine] = math::sine_cosine_degrees(light.angular_radius_degrees);
  return shading::DistantLight{math::normalize(light.direction), light.intensity, sine / cosine};
}
shading::Light compiled(const scene::RectangleLight& light) {
  return shading::RectangleLight{light.corner, light.edge_u, light.edge_v,
                                 math::normalize(math::cross(light.edge_u, light.edge_v)), light.radiance};
}
shading::Light compiled(const scene::SphereLight& light) {
  return shading::SphereLight{light.center, light.radius, light.radiance};
}

math::Color& brightness(scene::Light& light) {
  return std::visit(
      [](auto& l) -> math::Color& {
        if constexpr (requires { l.intensity; }) {
          return l.intensity;
        } else {
          return l.radiance;
        }
      },
      light);
}

bool differ_only_in_brightness(scene::Light a, scene::Light b) {
  brightness(a) = brightness(b) = {};
  return a == b;
}

/// Where it is, or the way that it shines from infinity.
std::array<double, 3> place_of(const scene::Light& light) {
  const Vec3 place = std::visit(
      [](const auto& l) {
        if constexpr (requires { l.position; }) {
          return l.position;
        } else if constexpr (requires { l.center; }) {
          return l.center;
        } else if constexpr (requires { l.corner; }) {
          return l.corner;
        } else {
          return l.direction;
        }
      },
      light);
  return {place.x, place.y, place.z};
}

/// Finds the spheres of the scene that show lights.
class Lamps {
 public:
  explicit Lamps(const accel::World& world) {
    for (std::uint32_t i = 0; i < world.items.size(); ++i) {
      const accel::Item& item = world.items[i];
      if (item.kind != accel::Kind::sphere || item.placement != accel::no_placement) continue;
      const geometry::SphereShape& sphere = world.spheres[item.index];
      items_.emplace(key(sphere.center, sphere.radius), i);
    }
  }
  std::uint32_t at(const shading::SphereLight& light) const {
    const auto found = items_.find(key(light.center, light.radius));
    return found == items_.end() ? accel::no_item : found->second;
  }

 private:
  using Key = std::array<double, 4>;
  static Key key(const Vec3& center, double radius) { return {center.x, center.y, center.z, radius}; }
  std::map<Key, std::uint32_t> items_;
};

/// Whether nothing of the scene but the item `lamp` reaches into a ball, for certain.
class FreeSpace {
 public:
  FreeSpace(const accel::World& world, std::uint32_t lamp, const Vec3& center, double radius)
      : world_(world), lamp_(lamp), center_(center), radius_(radius * (1 + 1e-9) + 1e-12 * math::taxicab(center)) {}

  bool is_free() const {
    for (std::uint32_t i = 0; i < world_.items.size(); ++i) {
      if (i != lamp_ && world_.items[i].kind != accel::Kind::patch && meets(world_.items[i])) return false;
    }
    return !meets(world_.triangles);
  }

 private:
  bool meets(const accel::Item& item) const {
    if (item.kind == accel::Kind::plane) {
      const geometry::PlaneShape& plane = world_.planes[item.index];
      return std::fabs(math::dot(plane.normal, center_ - plane.point)) <= radius_;
    }
    const auto box = accel::bounds_of(world_, item);
    if (box && !meets(*box)) return false;
    return item.kind != accel::Kind::mesh || item.placement != accel::no_placement ||
           meets(world_.meshes[item.index].triangles);
  }
  bool meets(const accel::TriangleSet& triangles) const {
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      if (meets(triangles.bounds_of(i))) return true;
    }
    return false;
  }
  bool meets(const math::Bounds& box) const {
    const Vec3 nearest = math::max(box.lower, math::min(center_, box.upper)) - center_;
    return math::dot(nearest, nearest) <= radius_ * radius_;
  }

  const accel::World& world_;
  std::uint32_t lamp_;
  Vec3 center_;
  double radius_;
};

}  // namespace

std::vector<shading::Light> compile_lights(const std::vector<scene::Light>& lights, const accel::World& world,
                                           const CompileSettings& settings, std::uint64_t& merged) {
  std::vector<scene::Light> kept;
  std::multimap<std::array<double, 3>, std::size_t> kept_at;
  for (scene::Light light : lights) {
    if (settings.is_canceled()) break;
    const auto [begin, end] = kept_at.equal_range(place_of(light));
    const auto twin =
        std::find_if(begin, end, [&](const auto& at) { return differ_only_in_brightness(kept[at.second], light); });
    if (settings.merge_lights && twin != end) {
      brightness(kept[twin->second]) += brightness(light);
      ++merged;
    } else {
      kept_at.emplace(place_of(light), kept.size());
      kept.push_back(light);
    }
  }
  std::vector<shading::Light> result;
  std::optional<Lamps> lamps;
  constexpr std::size_t most_work = 100'000'000;  // of surfaces looked at: under a second
  std::size_t work = 0;
  for (const scene::Light& light : kept) {
    result.push_back(std::visit([](const auto& l) { return compiled(l); }, light));
    if (auto* sphere = std::get_if<shading::SphereLight>(&result.back())) {
      if (!lamps) lamps.emplace(world);
      sphere->lamp = lamps->at(*sphere);
      // What is not looked at does not stand free.
      work += world.items.size() + world.triangles.size();
      sphere->stands_free =
          work < most_work && FreeSpace(world, sphere->lamp, sphere->center, sphere->radius).is_free();
    }
  }
  return result;
}

}  // namespace penumbra::render
