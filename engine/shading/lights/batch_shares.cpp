#include "engine/shading/lights/batch_shares.h"

#include "engine/shading/phong.h"

namespace penumbra::shading {

BatchShares::BatchShares(const BatchLighting& lighting, const LightTerms& terms)
    : lighting_(lighting), terms_(terms), lit_(lighting.points.lit()) {
  if (!lighting.switches.lights_without_share) return;
  const LaneMask away = lit_ & ~terms.facing;
  lighting.counters.lights_facing_away += static_cast<Count>(std::popcount(away));
  lit_ &= terms.facing;
}

Color BatchShares::lobe(std::size_t lane) const {
  if (((terms_.facing & terms_.in_front) >> lane & 1) == 0) return math::black;
  const CompiledMaterial& material = *lighting_.points.point(lane).material;
  return material.diffuse * terms_.diffuse[lane] + highlight(material, terms_.mirrored[lane]);
}

void BatchShares::add_visible(const Seen& seen) {
  LaneMask idle = 0;
  for_each_lane(lit_, [&](std::size_t lane) {
    if (math::is_black(shares_[lane])) idle |= LaneMask{1} << lane;
  });
  add_visible(seen, lit_ & ~idle);
  // On its own, even if work for nothing is to be done: what adds nothing has no say in what others see.
  if (lighting_.switches.lights_without_share) {
    lighting_.counters.lights_without_effect += static_cast<Count>(std::popcount(idle));
  } else {
    add_visible(seen, idle);
  }
}

void BatchShares::add_visible(const Seen& seen, LaneMask lanes) {
  if (lanes == 0) return;
  DiscBatch disc;
  disc.axis = terms_.towards, disc.is_infinite = seen.target.is_infinite;
  if (seen.radius > 0) set_half_axes(seen.target.is_infinite ? terms_.towards : terms_.l, seen.radius, disc);
  std::array<Visibility, lane_count> visible;
  lighting_.shadows.see({lighting_.points, lanes, disc, terms_.l, seen.target, seen.radius, seen.name.index,
                         lighting_.keys, seen.name.samples},
                        lighting_.sampling, visible.data());
  for_each_lane(lanes, [&](std::size_t lane) {
    lighting_.sums.color[lane] += lighting_.of(lane).visible(shares_[lane], visible[lane]);
  });
}

}  // namespace penumbra::shading
