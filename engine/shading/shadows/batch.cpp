#include <algorithm>
#include <cmath>

#include "engine/shading/shadows/shadows.h"
#include "engine/shading/shadows/shared_samples.h"

namespace penumbra::shading::shadows {
namespace {

/// Of the samples of a batch, those that are taken first: one of each point at least. So many at least have to agree.
/// Area lights are often wide, and hidden by a little over much of the picture.
constexpr std::size_t samples_per_first = 4, samples_per_first_of_area = 2, least_first = 4;

/// Neither lit nor dark, beyond rounding.
bool is_partly(const Color& seen) {
  constexpr double rounding = 1e-9;
  const auto channel = [](double share) { return share > rounding && share < 1 - rounding; };
  return channel(seen.r) || channel(seen.g) || channel(seen.b);
}

LaneMask lanes_below(std::size_t lane) { return (LaneMask{1} << lane) - 1; }

}  // namespace

void Shadows::see(const SeenBatch& batch, const DiscSampling& sampling, Visibility* seen) {
  if (!(batch.radius > 0)) return see_points(batch, seen);
  SeenBatch few = batch;
  for_each_lane(batch.lanes, [&](std::size_t lane) {
    if (!are_few(batch.points.point(lane), sampling)) few.lanes &= ~(LaneMask{1} << lane);
  });
  if (few.lanes != 0) see_few(few, sampling, seen);
  const LaneMask others = batch.lanes & ~few.lanes;
  LaneMask partly = 0;
  for_each_lane(others, [&](std::size_t lane) {
    const SeenDisc disc{batch.disc.axis[lane], batch.target.is_infinite ? batch.disc.axis[lane] : batch.l[lane],
                        batch.radius, batch.target.is_infinite};
    seen[lane] =
        aim(batch.points.point(lane), batch.light, batch.target, sampling).disc(disc, sampling, batch.place(lane));
    // What many samples show as lit or dark is, whether or not that is known for certain.
    if (is_partly(seen[lane].mean)) partly |= LaneMask{1} << lane;
  });
  if (sampling.may_lean) share(batch.points, partly, false, seen);
}

void Shadows::share(const PointBatch& points, LaneMask lanes, bool is_one_pattern, Visibility* seen) {
  if (switches_.shared_samples && lanes != 0)
    counters_.lights_from_neighbours += share_samples(points, lanes, is_one_pattern, seen);
}

void Shadows::see_points(const SeenBatch& batch, Visibility* seen) {
  // A ray in a bundle costs less than to ask what the lanes' cells share.
  const double limit = batch.disc.limit();
  for_each_lane(batch.lanes, [&](std::size_t lane) {
    seen[lane].is_certain = true;
    add_ray(batch.points.point(lane), batch.disc.axis[lane], limit, seen[lane].mean);
  });
  cast_bundle(limit);
}

void Shadows::see_few(const SeenBatch& batch, const DiscSampling& sampling, Visibility* seen) {
  const auto name = static_cast<std::size_t>(std::countr_zero(batch.lanes));
  const sampling::DiscSpiral::Turn turn = sampling::DiscSpiral::turn(batch.place(name).key());
  sampling::DiscSpirals::Points points;
  Lanes3 ways;
  const auto ways_of = [&](std::size_t round) -> const Lanes3& {
    sampling.few->points(round, turn, points);
    find_ways(batch.disc, points, ways);
    return ways;
  };
  see_few({batch.points, batch.lanes, batch.lanes & whole_above_horizon(batch.points, batch.disc),
           sampling.few->count(), batch.disc.limit(), sampling.may_lean},
          ways_of, seen);
}

void Shadows::see(const SeenSamples& samples, Visibility* seen) {
  see_few(
      {samples.points, samples.lanes, samples.whole, samples.ways.size(), 1, samples.may_lean, samples.weights},
      [&](std::size_t round) -> const Lanes3& { return samples.ways[round]; }, seen);
}

template <class WaysOf>
void Shadows::see_few(const Few& few, const WaysOf& ways_of, Visibility* seen) {
  const std::size_t count = few.count, all = count * lane_count;
  counters_.lights_from_few_rays += static_cast<Count>(std::popcount(few.lanes));
  transmittances_.resize(all);
  // A light that the horizon cuts is neither lit nor dark, whatever some samples say.
  const LaneMask whole = few.whole, cut = few.lanes & ~whole;
  const auto wholes = static_cast<std::size_t>(std::popcount(whole));
  First first{};
  LaneMask rest = few.lanes;
  const std::size_t per_first = few.weights == nullptr ? samples_per_first : samples_per_first_of_area;
  const std::size_t end_of_first = std::max(lane_count, all / per_first);
  if (switches_.agreeing_rays && few.may_lean && wholes >= least_first) {
    if (!cast(few, whole, {0, end_of_first}, ways_of)) return;
    first = told_by(whole, end_of_first);
    if (first.agree()) {
      const double off = 0.5 / (static_cast<double>(first.count) + 1);
      const Visibility agreed{first.lit > 0 ? math::white : math::black, {{}, math::grey(off * off)}, false};
      for_each_lane(whole, [&](std::size_t lane) {
        seen[lane] = agreed;
        for (std::size_t i = lane; i < all; i += lane_count) transmittances_[i] = agreed.mean;
      });
      counters_.shadow_rays_agreed += wholes * count - first.count;
      rest = cut;
    }
    if (!cast(few, cut, {0, end_of_first}, ways_of) || !cast(few, rest, {end_of_first, all}, ways_of)) return;
  } else if (!cast(few, rest, {0, all}, ways_of)) {
    return;
  }
  const Weights weights = weights_of(few, rest);
  for_each_lane(rest, [&](std::size_t lane) {
    seen[lane] = mean_of(lane, count, lane_count, weights.of != nullptr ? &weights : nullptr);
  });
  if (few.may_lean) share(few.points, rest & whole, true, seen);
  if (first.nearly_agree()) note_missed(whole, count, first, seen);
}

Shadows::Weights Shadows::weights_of(const Few& few, LaneMask lanes) const {
  if (few.weights == nullptr) return {nullptr, {}};
  Color sum;
  double weight = 0;
  for_each_lane(lanes, [&](std::size_t lane) {
    for (std::size_t i = lane; i < few.count * lane_count; i += lane_count)
      sum += transmittances_[i] * few.weights[i], weight += few.weights[i];
  });
  return {few.weights, weight > 0 ? sum * (1 / weight) : math::white};
}

void Shadows::note_missed(LaneMask lanes, std::size_t count, const First& first, Visibility* seen) const {
  const Color most = first.lit > first.dark ? math::white : math::black;
  // Of the point that one of them shows to differ, all samples and those after them.
  std::size_t differing = 0, after = 0, differing_after = 0, which = 0;
  for (std::size_t i = 0; i < first.end; ++i) {
    const std::size_t lane = i % lane_count;
    if ((lanes >> lane & 1) != 0 && !(transmittances_[i] == most)) which = lane;
  }
  for (std::size_t i = which; i < count * lane_count; i += lane_count) {
    const bool differs = !(transmittances_[i] == most);
    differing += differs;
    if (i >= first.end) ++after, differing_after += differs;
  }
  const double rest = static_cast<double>(after), s = static_cast<double>(differing_after) / std::max(1.0, rest);
  const double s_of_rest = rest > 1 ? s * (1 - s) * rest / (rest - 1) : 1.0 / 6;
  const double times = static_cast<double>(count - after) * std::popcount(lanes);
  const Color apart = (seen[which].mean - most) * (static_cast<double>(count) / static_cast<double>(differing));
  const Color missed = apart * apart * (s_of_rest / times);
  for_each_lane(lanes, [&](std::size_t lane) { seen[lane].missed = missed; });
}

template <class WaysOf>
bool Shadows::cast(const Few& few, LaneMask lanes, const Rounds& rounds, const WaysOf& ways_of) {
  if (lanes == 0) return true;
  std::size_t taken = 0;
  for (std::size_t begin = rounds.begin, end; begin < rounds.end; begin = end) {
    const std::size_t round = begin / lane_count, start = round * lane_count;
    end = std::min(rounds.end, start + lane_count);
    const Lanes3& ways = ways_of(round);
    for_each_lane(lanes & ~lanes_below(begin - start) & lanes_below(end - start), [&](std::size_t lane) {
      add_ray(few.points.point(lane), ways[lane], few.limit, transmittances_[start + lane]);
    });
    taken += lane_count;
    if (taken >= samples_between_looks && is_canceled_()) return bundle_.clear(), false;
  }
  cast_bundle(few.limit);
  return true;
}

Shadows::First Shadows::told_by(LaneMask lanes, std::size_t end) const {
  First first{end};
  for (std::size_t start = 0; start < end; start += lane_count) {
    for_each_lane(lanes & lanes_below(std::min(end - start, lane_count)), [&](std::size_t lane) {
      const Color& seen = transmittances_[start + lane];
      ++first.count;
      first.lit += seen == math::white ? 1 : 0, first.dark += seen == math::black ? 1 : 0;
    });
  }
  return first;
}

}  // namespace penumbra::shading::shadows
