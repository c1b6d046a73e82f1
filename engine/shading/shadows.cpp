#include "engine/shading/shadows.h"

#include <algorithm>
#include <cmath>

#include "engine/math/error_free.h"

namespace penumbra::shading {
namespace {

using math::dot;

/// Modelled as `constant`·s(1 − s) / `count_to_the_power`, where s is the share that gets through. That `count` samples
/// agree does not mean that all would: s is as far from 0 and 1 as half a sample more would put it.
Visibility with_variance(const sampling::Halves& halves, sampling::Halves::Order order, double constant, double count,
                         double count_to_the_power) {
  const Color mean = halves.mean();
  const double least = 0.5 / (count + 1);
  const auto variance = [&](double share) {
    const double s = std::clamp(share, least, 1 - least);
    return constant * s * (1 - s) / count_to_the_power;
  };
  return {mean, {halves.variance(order), {variance(mean.r), variance(mean.g), variance(mean.b)}}};
}

}  // namespace

Color Shadows::through_items(const std::vector<std::uint32_t>& items) const {
  Color product = math::white;
  for (const std::uint32_t item : items) product = product * scene_.materials[scene_.item_material[item]].transmission;
  return product;
}

Color Shadows::transmittance(const ShadingPoint& at, const Vec3& towards, double limit) {
  const bool is_behind = dot(at.facing, towards) < 0;
  if (is_behind && !at.material->transmits) return math::black;
  ++counters_.shadow;
  crossed_.clear();
  if (!accel::cross_transparent(scene_.world, {leave_surface(at.surface, towards), towards, at.id}, limit, crossed_))
    return math::black;
  const Color product = through_items(crossed_.sorted());
  return is_behind ? product * own_surface(at) : product;
}

Shadows::Verdict Shadows::classify(const ShadingPoint& at, const std::array<Vec3, 4>& corners, bool is_infinite) {
  if (!use_candidates_) return Verdict::unknown;
  const Vec3 middle = (corners[0] + corners[1] + corners[2] + corners[3]) * 0.25;
  const Vec3 apex = leave_surface(at.surface, dot(at.facing, middle) < 0 ? -at.facing : at.facing);
  std::array<Vec3, 4> targets = corners;
  if (!is_infinite) {
    for (Vec3& corner : targets) corner += at.surface.position;
  }
  const bool is_outside = dot(at.facing, at.surface.normal) > 0;
  const bool leaves_self = is_outside && std::all_of(corners.begin(), corners.end(), [&](const Vec3& corner) {
                             return dot(at.facing, corner) > math::gamma(64) * math::length(corner);
                           });
  candidates_.gather(scene_.world, accel::Shaft(apex, targets, is_infinite), at.id, leaves_self);
  if (candidates_.is_dark()) return Verdict::dark;
  if (candidates_.has_overflowed()) return Verdict::unknown;
  return candidates_.list().empty() ? Verdict::lit : Verdict::listed;
}

Color Shadows::transmittance_of_sample(Verdict verdict, const ShadingPoint& at, const Vec3& towards, double limit) {
  if (verdict == Verdict::unknown) return transmittance(at, towards, limit);
  const bool is_behind = dot(at.facing, towards) < 0;
  if (is_behind && !at.material->transmits) return math::black;
  const Color own = is_behind ? own_surface(at) : math::white;
  if (verdict == Verdict::lit) {
    ++counters_.shadow_rays_lit;
    return own;
  }
  ++counters_.shadow_rays_listed;
  const geometry::Ray ray{leave_surface(at.surface, towards), towards, at.id};
  const geometry::PreparedRay prepared(ray.origin, ray.direction);
  crossed_.clear();
  for (const accel::Candidate& candidate : candidates_.list()) {
    const int count = candidate.is_triangle ? intersect(candidate.triangle, prepared, limit).has_value()
                                            : accel::count_crossings(scene_.world, candidate.surface.item, ray, limit);
    if (count > 0 && candidate.is_opaque) return math::black;
    for (int i = 0; i < count; ++i) crossed_.add(candidate.surface.item);
  }
  return own * through_items(crossed_.sorted());
}

Visibility Shadows::disc(const ShadingPoint& at, const Vec3& axis, const Vec3& u, const Vec3& v, double limit,
                         const DiscSampling& sampling, const sampling::Key& key) {
  const auto count = static_cast<std::uint64_t>(sampling.spiral.count());
  const double fu = dot(at.facing, u), fv = dot(at.facing, v);
  const bool is_above_horizon = dot(at.facing, axis) > std::sqrt(fu * fu + fv * fv);
  const Verdict verdict = classify(at, {axis - u - v, axis + u - v, axis + u + v, axis - u + v}, limit == HUGE_VAL);
  if (verdict == Verdict::dark) {
    counters_.shadow_rays_dark += count;
    return {math::black, {}};
  }
  if (verdict == Verdict::lit && is_above_horizon) {
    counters_.shadow_rays_lit += count;
    return {};
  }
  if (verdict != Verdict::unknown) {
    const Vec3 from = leave_surface(at.surface, at.facing);
    const bool is_infinite = limit == HUGE_VAL;
    const DiscView view{from, is_infinite ? axis : axis - (from - at.surface.position), u, v, is_infinite};
    if (find_covers(at, view, !is_above_horizon)) {
      counters_.shadow_rays_covered += count;
      const double chords = sampling.chords.count();
      const auto halves =
          mean_transmittance({covers_.data(), covers_.size()}, view, sampling.chords, key.uniform(0), key.uniform(1));
      return with_variance(halves, sampling::Halves::chords(sampling.chords.count()), chord_variance, chords,
                           chords * chords * chords);
    }
  }
  const sampling::DiscSpiral::Turn turn = sampling::DiscSpiral::turn(key);
  sampling::Halves halves;  // every second point of the spiral makes a spiral again
  for (int i = 0; i < sampling.spiral.count(); ++i) {
    const auto [x, y] = sampling.spiral.point(i, turn);
    halves.add(i % 2 == 1, transmittance_of_sample(verdict, at, axis + u * x + v * y, limit));
  }
  const double n = sampling.spiral.count();
  return with_variance(halves, sampling::Halves::points, spread_variance, n, n * std::sqrt(n));
}

bool Shadows::find_covers(const ShadingPoint& at, const DiscView& view, bool has_horizon) {
  covers_.clear();
  for (const accel::Candidate& candidate : candidates_.list()) {
    const std::uint32_t id = candidate.surface.item;
    const accel::Item& item = scene_.world.items[id];
    std::optional<DiscCover> cover;
    int crossings = 1;
    if (candidate.is_triangle) {
      cover = cover_of(candidate.triangle, view);
      if (!cover) continue;
    } else if (item.kind == accel::Kind::plane) {
      cover = cover_of(scene_.world.planes[item.index], view);
    } else if (item.kind == accel::Kind::sphere && item.placement == accel::not_placed && id != at.id.item) {
      cover = cover_of(scene_.world.spheres[item.index], view);
      crossings = 2;
    }
    if (!cover) return false;
    const Color& transmission = scene_.materials[scene_.item_material[id]].transmission;
    cover->is_opaque = candidate.is_opaque;
    cover->transmittance = crossings == 2 ? transmission * transmission : transmission;
    cover->place = candidate.surface;
    covers_.push_back(*cover);
  }
  if (has_horizon) {
    covers_.push_back(cover_below_horizon(at.facing, view));
    covers_.back().is_opaque = !at.material->transmits;
    covers_.back().transmittance = own_surface(at);
  }
  // In scene order, whatever structure found them: sums and products round the same way.
  std::sort(covers_.begin(), covers_.end(), [](const DiscCover& a, const DiscCover& b) { return a.place < b.place; });
  return true;
}

}  // namespace penumbra::shading
