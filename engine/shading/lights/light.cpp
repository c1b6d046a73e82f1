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
  if (visibility.is_certain) return filtered(share, visibility.mean);
  const Color scale = filtered(filtered(share, weight), filtered(share, weight));
  variance.measured += filtered(scale, visibility.variance.measured);
  variance.modelled += filtered(scale, visibility.variance.modelled);
  return filtered(share, visibility.mean);
}

Color Lighting::through(const Color& share, shadows::Sight sight, const shadows::SeenDisc& disc,
                        const sampling::Place& samples) const {
  // What adds nothing has no say.
  if (together != nullptr && !math::is_black(share)) {
    if (sight.is_sampled(sampling)) {
      together->add(sight.sampled(disc, samples), share, *this);
      return math::black;
    }
    if (const auto is_lit = sight.shared_verdict()) together->note(*is_lit);
  }
  return visible(share, sight.disc(disc, sampling, samples));
}

void Together::add(const shadows::SampledDisc& disc, const Color& share, const Lighting& lighting) {
  discs_[count_] = disc;
  discs_[count_].place = lighting.place;
  waiting_[count_++] = {share, &lighting};
}

void Together::finish(const DiscSampling& sampling, std::uint64_t name) {
  votes_.name = name;
  if (count_ > 0) shadows_.sample(std::span(discs_).first(count_), sampling, votes_);
  for (std::size_t i = 0; i < count_; ++i) {
    const auto& [share, lighting] = waiting_[i];
    *lighting->sum += lighting->visible(share, discs_[i].seen);
  }
  count_ = 0, votes_ = {};
}

}  // namespace penumbra::shading
