#include "engine/shading/lights/light.h"

namespace penumbra::shading {

bool Lighting::skip_if(bool adds_nothing, Count Counters::*counter) const {
  if (!adds_nothing || !switches.lights_without_share) return false;
  ++(counters.*counter);
  return true;
}

void Lighting::skip_samples(Count Counters::*counter) const {
  counters.*counter += static_cast<Count>(sampling.spiral.count());
}

Color Lighting::visible(const Color& share, const Visibility& visibility) const {
  if (!visibility.is_certain) {
    const Color arriving = filtered(share, weight), scale = filtered(arriving, arriving);
    variance.measured += filtered(scale, visibility.variance.measured + visibility.missed);
    variance.modelled += filtered(scale, visibility.variance.modelled);
  }
  return filtered(share, visibility.mean);
}

}  // namespace penumbra::shading
