#include <cmath>

#include "engine/math/constants.h"
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
  shadows::Sight sight =
      lighting.shadows.aim(at, place.index, {towards, light.tangent, true}, is_disc ? &lighting.sampling : nullptr);
  if (!is_disc) return filtered(share, sight.transmittance(towards, math::infinity));
  return lighting.through(share, sight, {towards, towards, light.tangent, true}, place.samples);
}

}  // namespace penumbra::shading
