#include <bit>
#include <cmath>

#include "engine/math/constants.h"
#include "engine/sampling/sobol.h"
#include "engine/shading/lights/area_light.h"
#include "engine/shading/phong.h"

namespace penumbra::shading {

FewSamples::FewSamples(const BatchLighting& lighting, const LightName& name, const Color& radiance)
    : lighting_(lighting),
      name_(name),
      radiance_(radiance),
      count_(static_cast<std::size_t>(lighting.sampling.spiral.count())),
      ways_(count_),
      weights_(count_ * lane_count),
      highlights_(count_ * lane_count) {}

sampling::Key FewSamples::key_of(std::size_t lane) const {
  // One pattern for all: its name is that of a point that is lit.
  const LaneMask lit = lighting_.points.lit();
  return lighting_.keys[lighting_.sampling.may_lean ? static_cast<std::size_t>(std::countr_zero(lit)) : lane].at(
      name_.samples);
}

sampling::Point2 FewSamples::square(std::size_t round, std::size_t lane, const sampling::Key& key) const {
  if (!lighting_.sampling.may_lean)
    return sampling::sobol_owen(key.sample() * static_cast<std::uint32_t>(count_) + static_cast<std::uint32_t>(round),
                                key);
  // Neighbours in the sequence are spread well: those of a lane, and all of one pattern. So that those of a round are,
  // too, lanes begin with another each; and every second of a lane's is of one half of them.
  const std::size_t place = (round + lane) % count_, half = (count_ + 1) / 2;
  const std::size_t index = lane * count_ + place / 2 + (place % 2 == 0 ? 0 : half);
  return sampling::sobol_owen(static_cast<std::uint32_t>(index), key);
}

void FewSamples::set(std::size_t round, std::size_t lane, const AreaPlace& place) {
  const ShadingPoint& at = lighting_.points.point(lane);
  const std::size_t index = round * lane_count + lane;
  const bool is_seen = is_on_viewers_side(at, place.direction);
  const double cosine = std::fabs(math::dot(place.direction, at.surface.shading_normal));
  ways_[round].set(lane, place.way);
  weights_[index] = is_seen ? cosine * place.solid_angle / projected_[lane] : 0;
  highlights_[index] = is_seen && !math::is_black(at.material->specular)
                           ? filtered(radiance_ * (place.solid_angle / math::pi), highlight(at, -place.direction))
                           : math::black;
}

void FewSamples::add_visible() {
  if (lanes_ == 0) return;
  std::array<Visibility, lane_count> seen;
  lighting_.shadows.see({lighting_.points, lanes_, whole_, ways_, weights_.data(), lighting_.sampling.may_lean},
                        seen.data());
  if (lighting_.is_canceled()) return;
  for_each_lane(lanes_, [&](std::size_t lane) {
    const Lighting alone = lighting_.of(lane);
    Color& sum = lighting_.sums.color[lane];
    sum += alone.visible(diffuse_of(alone.at, radiance_, projected_[lane]), seen[lane]);
    if (math::is_black(alone.at.material->specular)) return;
    sampling::Halves halves;
    for (std::size_t round = 0; round < count_; ++round) {
      const Color& open = highlights_[round * lane_count + lane];
      halves.add(round % 2 == 1, filtered(open, lighting_.shadows.transmittance(round, lane)));
    }
    sum += halves.mean();
    alone.variance.measured += halves.variance(sampling::Halves::points);
  });
}

}  // namespace penumbra::shading
