#include "engine/shading/lights/light_reach.h"

#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"
#include "engine/math/error_free.h"

namespace penumbra::shading {
namespace {

using math::Bounds;

/// Less than any cosine: light that goes all ways.
constexpr double all_ways = -2;
/// Of a few dozen operations, and of a power.
constexpr double reach_rounding = math::gamma(64);

constexpr Bounds all_directions{{-1, -1, -1}, {1, 1, 1}};

struct Range {
  double least = 0, most = 0;
};

/// Of the products of a vector in the one box and one in the other.
Range dot(const Bounds& a, const Bounds& b) {
  Range sum;
  const auto add = [&](double a_lower, double a_upper, double b_lower, double b_upper) {
    const double products[]{a_lower * b_lower, a_lower * b_upper, a_upper * b_lower, a_upper * b_upper};
    sum.least += std::min(std::min(products[0], products[1]), std::min(products[2], products[3]));
    sum.most += std::max(std::max(products[0], products[1]), std::max(products[2], products[3]));
  };
  add(a.lower.x, a.upper.x, b.lower.x, b.upper.x);
  add(a.lower.y, a.upper.y, b.lower.y, b.upper.y);
  add(a.lower.z, a.upper.z, b.lower.z, b.upper.z);
  return sum;
}

Vec3 farthest(const Bounds& box) { return math::max(math::abs(box.lower), math::abs(box.upper)); }
Vec3 nearest(const Bounds& box) { return math::max(Vec3{}, math::max(box.lower, -box.upper)); }

/// From the lights to the points.
struct Ways {
  Bounds box;
  double least;     // length
  double rounding;  // of what is measured along them, as the lights' own formulas do
  Ways(const LightReach& from, const LitRegion& to)
      : box{to.positions.lower - from.places.upper, to.positions.upper - from.places.lower},
        least(std::sqrt(math::dot(nearest(box), nearest(box)))),
        rounding(reach_rounding * (from.size + to.size)) {}
};

LightReach reach(const Bounds& places, const Color& intensity, const scene::Attenuation& attenuation) {
  LightReach result;
  result.places = places, result.size = math::taxicab(farthest(places));
  result.axes = all_directions, result.least_cosine = all_ways, result.exponent = 0;
  result.intensity = intensity, result.attenuation = attenuation;
  return result;
}

LightReach along(LightReach reach, const Vec3& axis, double least_cosine, double exponent) {
  reach.axes = {axis, axis}, reach.least_cosine = least_cosine, reach.exponent = exponent, reach.is_even = false;
  return reach;
}

constexpr scene::Attenuation by_distance_squared{0, 0, 1};

std::optional<LightReach> bounded(const DiscLight& light) {
  const LightReach result = reach({light.position, light.position}, light.intensity, light.attenuation);
  if (!light.is_spot) return result;
  const double cosine = light.exponent > 0 ? std::max(0.0, light.cutoff_cosine) : light.cutoff_cosine;
  return along(result, light.direction, cosine, light.exponent);
}
std::optional<LightReach> bounded(const DistantLight&) { return std::nullopt; }
std::optional<LightReach> bounded(const RectangleLight& light) {
  Bounds places;
  for (const Vec3& edge : {Vec3{}, light.edge_u, light.edge_v, light.edge_u + light.edge_v})
    places.include(light.corner + edge);
  // dω = cos θ dA / d²
  const double area = math::length(math::cross(light.edge_u, light.edge_v));
  return along(reach(places, light.radiance * (area / math::pi), by_distance_squared), light.normal, 0, 1);
}
std::optional<LightReach> bounded(const SphereLight& light) {
  const Vec3 half{light.radius, light.radius, light.radius};
  // It fills less than π r² / ((d − r)(d + r)), as its tangents' circle does on a plane at distance 1.
  return reach({light.center - half, light.center + half}, light.radiance * (light.radius * light.radius),
               by_distance_squared);
}

}  // namespace

void LitRegion::add(const ShadingPoint& at, const Color& weight) {
  const Vec3& n = at.surface.shading_normal;
  const CompiledMaterial& material = *at.material;
  const auto most = [](const Color& a, const Color& b) {
    return Color{std::max(a.r, b.r), std::max(a.g, b.g), std::max(a.b, b.b)};
  };
  positions.include(at.surface.position), facings.include(at.facing), normals.include(n);
  // −v·r = l·mirror
  mirrors.include(n * (2 * math::dot(at.view, n)) - at.view);
  diffuse = most(diffuse, material.diffuse * weight), specular = most(specular, material.specular * weight);
  if (!math::is_black(material.specular)) shininess = std::min(shininess, material.shininess);
  size = std::max(size, math::taxicab(at.surface.position));
}

void LightReach::include(const LightReach& other) {
  places.include(other.places), axes.include(other.axes);
  least_cosine = std::min(least_cosine, other.least_cosine), exponent = std::min(exponent, other.exponent);
  is_even = is_even && other.is_even;
  intensity += other.intensity;
  attenuation = {std::min(attenuation.constant, other.attenuation.constant),
                 std::min(attenuation.linear, other.attenuation.linear),
                 std::min(attenuation.quadratic, other.attenuation.quadratic)};
  size = std::max(size, other.size);
}

bool LightReach::may_light(const LitRegion& region) const {
  const Ways ways(*this, region);
  if (dot(region.facings, ways.box).least > ways.rounding) return false;
  if (least_cosine <= -1) return true;
  const double cosine = least_cosine - reach_rounding;
  const Vec3 far = farthest(ways.box);
  const double length = cosine > 0 ? ways.least : std::sqrt(math::dot(far, far));
  // A length that its square cannot hold tells nothing.
  return !(length < math::infinity) || !(dot(axes, ways.box).most < cosine * length - ways.rounding);
}

bool LightReach::lights_for_certain(const LitRegion& region) const {
  return is_even && dot(region.facings, Ways(*this, region).box).most < 0;
}

double LightReach::most(const LitRegion& region) const {
  const Ways ways(*this, region);
  const double d = ways.least;
  const double divisor = attenuation.constant + attenuation.linear * d + attenuation.quadratic * d * d;
  if (!(d > 0 && d < math::infinity && divisor > 0)) return math::infinity;
  const auto cosine = [&](const Range& along) { return std::clamp(along.most / d + reach_rounding, 0.0, 1.0); };
  const Range straight = dot(region.normals, ways.box);
  Color sent = region.diffuse * std::min(1.0, std::max(-straight.least, straight.most) / d);
  if (!math::is_black(region.specular))
    sent += region.specular * math::power(cosine(dot(region.mirrors, ways.box)), region.shininess);
  const double side = exponent > 0 ? math::power(cosine(dot(axes, ways.box)), exponent) : 1;
  return math::max_channel(intensity * sent) * (side / divisor) * (1 + reach_rounding);
}

std::optional<LightReach> reach_of(const Light& light) {
  return std::visit([](const auto& l) { return bounded(l); }, light);
}

}  // namespace penumbra::shading
