#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"
#include "engine/shading/lights/batch_shares.h"
#include "engine/shading/lights/light.h"
#include "engine/shading/phong.h"

namespace penumbra::shading {
namespace {

/// How much of a spot's light goes the way of the unit `l`.
double strength_of(const DiscLight& light, const Vec3& l) {
  if (!light.is_spot) return 1;
  const double cosine = math::dot(light.direction, l);
  return cosine < light.cutoff_cosine ? 0 : math::power(std::clamp(cosine, 0.0, 1.0), light.exponent);
}

/// How much of its light there is so far from it.
Color arriving_at(double distance, const DiscLight& light) {
  const double divisor = light.attenuation.constant + light.attenuation.linear * distance +
                         light.attenuation.quadratic * distance * distance;
  return light.intensity * (1 / std::max(divisor, 1e-300));
}

}  // namespace

Color lit_by(const DiscLight& light, const Lighting& lighting, const LightPlace& place) {
  const ShadingPoint& at = lighting.at;
  const Vec3 towards = light.position - at.surface.position;
  if (lighting.skip_if(!is_on_viewers_side(at, towards), &Counters::lights_facing_away)) return math::black;
  const double distance = math::length(towards);
  const Vec3 l = towards * (-1 / distance);
  const Color lobe = lobe_towards(at, l) * strength_of(light, l);
  if (lighting.skip_if(math::is_black(lobe), &Counters::lights_without_effect)) return math::black;
  const Color share = filtered(arriving_at(distance, light), lobe);
  if (lighting.skip_if(math::is_black(share), &Counters::lights_without_effect)) return math::black;
  const bool is_disc = light.radius > 0;
  const shadows::Target target{light.position, light.radius};
  shadows::Sight sight = is_disc ? lighting.shadows.aim(at, place.index, target, lighting.sampling)
                                 : lighting.shadows.aim(at, place.index, target, false);
  if (!is_disc) return filtered(share, sight.transmittance(towards, 1));
  return lighting.visible(share, sight.disc({towards, l, light.radius}, lighting.sampling, place.samples));
}

void light_batch(const DiscLight& light, const BatchLighting& lighting, const LightName& name) {
  LightTerms terms;
  find_terms(lighting.points, light.position, terms);
  BatchShares shares(lighting, terms);
  for_each_lane(shares.lit(), [&](std::size_t lane) {
    const Color lobe = shares.lobe(lane) * strength_of(light, terms.l[lane]);
    shares.set(lane, filtered(arriving_at(terms.distance[lane], light), lobe));
  });
  shares.add_visible({{light.position, light.radius}, light.radius, name});
}

}  // namespace penumbra::shading
