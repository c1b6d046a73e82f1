#include <cmath>

#include "engine/math/constants.h"
#include "engine/shading/lights/batch_shares.h"
#include "engine/shading/lights/light.h"
#include "engine/shading/phong.h"

namespace penumbra::shading {

Color lit_by(const DistantLight& light, const Lighting& lighting, const LightPlace& place) {
  const ShadingPoint& at = lighting.at;
  const Vec3 towards = -light.direction;
  if (lighting.skip_if(!is_on_viewers_side(at, towards), &Counters::lights_facing_away)) return math::black;
  const Color share = filtered(light.intensity, lobe_towards(at, light.direction));
  if (lighting.skip_if(math::is_black(share), &Counters::lights_without_effect)) return math::black;
  const bool is_disc = light.tangent > 0;
  const shadows::Target target{towards, light.tangent, true};
  shadows::Sight sight = is_disc ? lighting.shadows.aim(at, place.index, target, lighting.sampling)
                                 : lighting.shadows.aim(at, place.index, target, false);
  if (!is_disc) return filtered(share, sight.transmittance(towards, math::infinity));
  return lighting.visible(share, sight.disc({towards, towards, light.tangent, true}, lighting.sampling, place.samples));
}

void light_batch(const DistantLight& light, const BatchLighting& lighting, const LightName& name) {
  LightTerms terms;
  find_terms_along(lighting.points, light.direction, terms);
  BatchShares shares(lighting, terms);
  for_each_lane(shares.lit(),
                [&](std::size_t lane) { shares.set(lane, filtered(light.intensity, shares.lobe(lane))); });
  shares.add_visible({{-light.direction, light.tangent, true}, light.tangent, name});
}

}  // namespace penumbra::shading
