#include <algorithm>
#include <cmath>
#include <memory>
#include <span>

#include "engine/shading/shadows/shadows.h"

namespace penumbra::shading::shadows {

using math::dot;

namespace {

/// Of so many points that agree on their first samples, one takes the others too, and tells how far off the rest are.
constexpr std::uint64_t agreements_per_check = 8;

Color positive(const Color& c) { return {std::max(0.0, c.r), std::max(0.0, c.g), std::max(0.0, c.b)}; }

}  // namespace

Color Shadows::through_items(const std::vector<std::uint32_t>& items) const {
  Color product = math::white;
  for (const std::uint32_t item : items) product = product * scene_.materials[scene_.item_material[item]].transmission;
  return product;
}

bool Sight::cross(const Vec3& towards, double limit) {
  shadows_.crossed_.clear();
  const geometry::Ray ray{leave_surface(at_.surface, towards), towards, at_.id};
  if (listed() == nullptr) {
    ++counters_.rays.shadow;
    return accel::cross_transparent(scene_.world, ray, limit, shadows_.crossed_);
  }
  ++counters_.shadow_rays_listed;
  return cross_transparent(scene_.world, *cell_, ray, limit, shadows_.crossed_);
}

Color Sight::transmittance(const Vec3& towards, double limit) {
  const bool is_behind = dot(at_.facing, towards) < 0;
  if (is_behind && !at_.material->transmits) return math::black;
  if (!is_behind && (shared() == Shared::lit || shared() == Shared::dark)) {
    ++(shared() == Shared::lit ? counters_.shadow_rays_lit : counters_.shadow_rays_dark);
    return shared() == Shared::lit ? math::white : math::black;
  }
  if (!cross(towards, limit)) return math::black;
  const Color product = shadows_.through_items(shadows_.crossed_.sorted());
  return is_behind ? product * own_surface() : product;
}

Visibility Sight::sample(const DiscView& disc, const DiscSampling& sampling, const sampling::Key& key) {
  SampledDisc one{&at_, disc, sampling::DiscSpiral::turn(key)};
  if (listed() == nullptr) {
    shadows_.sample({&one, 1}, sampling);
    return one.seen;
  }
  std::vector<Color>& transmittances = shadows_.transmittances_;
  transmittances.resize(static_cast<std::size_t>(sampling.spiral.count()));
  for (std::size_t i = 0; i < transmittances.size(); ++i) {
    if ((i + 1) % samples_between_looks == 0 && shadows_.is_canceled_()) return {};
    const auto [x, y] = sampling.spiral.point(static_cast<int>(i), one.turn);
    transmittances[i] = transmittance(disc.at(x, y), disc.limit());
  }
  return shadows_.mean_of(0, transmittances.size());
}

void Shadows::sample(std::span<SampledDisc> discs, const DiscSampling& sampling, const Votes& votes) {
  const auto count = static_cast<std::size_t>(sampling.spiral.count());
  transmittances_.resize(count * discs.size());
  for (const SampledDisc& disc : discs) counters_.lights_from_few_rays += are_few(*disc.at, sampling) ? 1 : 0;
  const std::size_t voters = (discs.size() + votes.lit + votes.dark) * sampling.first_count();
  const bool may_agree = switches_.agreeing_rays && are_few(*discs.front().at, sampling) && voters >= 2 * count;
  if (!cast(discs, sampling, may_agree ? Samples::first : Samples::all)) return;
  const Agreement agreed = may_agree ? agreement(discs, sampling, votes) : Agreement::none;
  const Color of_all = agreed == Agreement::lit ? math::white : math::black;
  const bool is_check = votes.name % agreements_per_check == 0;
  if (agreed != Agreement::none && !is_check) {
    const double off = 0.5 / (static_cast<double>(voters) + 1);
    const Visibility seen{of_all, {{}, Color{off * off, off * off, off * off}}, false};
    for (SampledDisc& disc : discs) disc.seen = seen;
    counters_.shadow_rays_agreed += (count - sampling.first_count()) * discs.size();
    return;
  }
  if (may_agree && !cast(discs, sampling, Samples::others)) return;
  for (std::size_t k = 0; k < discs.size(); ++k) {
    Visibility& seen = discs[k].seen = mean_of(k, count);
    if (agreed == Agreement::none) continue;
    const Color apart = seen.mean - of_all, squared = apart * apart;
    seen.variance.measured += positive(squared - seen.variance.measured) * (agreements_per_check - 1.0);
  }
}

bool Shadows::cast(std::span<const SampledDisc> discs, const DiscSampling& sampling, Samples which) {
  const auto count = static_cast<std::size_t>(sampling.spiral.count());
  const double limit = discs.front().disc.limit();
  const std::size_t width = switches_.shadow_bundles ? accel::bundle_width : 1;
  std::size_t size = 0, taken = 0;
  for (const int i : sampling.spiral.around()) {
    const auto index = static_cast<std::size_t>(i);
    for (std::size_t k = 0; k < discs.size(); ++k) {
      if (which != Samples::all && sampling.is_first(index, discs[k].place) != (which == Samples::first)) continue;
      if (++taken % samples_between_looks == 0 && is_canceled_()) return false;
      const ShadingPoint& at = *discs[k].at;
      Color& transmittance = transmittances_[k * count + index];
      const auto [x, y] = sampling.spiral.point(i, discs[k].turn);
      const Vec3 direction = discs[k].disc.at(x, y);
      if (dot(at.facing, direction) < 0 && !at.material->transmits) {
        transmittance = math::black;
        continue;
      }
      std::construct_at(&bundle_[size], leave_surface(at.surface, direction), direction);
      selves_[size] = at.id;
      of_[size++] = {&at, &transmittance};
      if (size == width) cast_bundle(size, limit), size = 0;
    }
  }
  if (size > 0) cast_bundle(size, limit);
  return true;
}

Shadows::Agreement Shadows::agreement(std::span<const SampledDisc> discs, const DiscSampling& sampling,
                                      const Votes& votes) const {
  const auto count = static_cast<std::size_t>(sampling.spiral.count());
  bool is_lit = votes.dark == 0, is_dark = votes.lit == 0;
  for (std::size_t k = 0; k < discs.size() && (is_lit || is_dark); ++k) {
    for (std::size_t i = 0; i < count; ++i) {
      if (!sampling.is_first(i, discs[k].place)) continue;
      const Color& transmittance = transmittances_[k * count + i];
      is_lit = is_lit && transmittance == math::white, is_dark = is_dark && transmittance == math::black;
    }
  }
  return is_lit ? Agreement::lit : is_dark ? Agreement::dark : Agreement::none;
}

Visibility Shadows::mean_of(std::size_t disc, std::size_t count) const {
  sampling::Halves halves;  // every second point of the spiral makes a spiral again
  for (std::size_t i = 0; i < count; ++i) halves.add(i % 2 == 1, transmittances_[disc * count + i]);
  const auto n = static_cast<double>(count);
  return estimated(halves, sampling::Halves::points, spread_variance, n, n * std::sqrt(n));
}

void Shadows::cast_bundle(std::size_t size, double limit) {
  for (accel::Crossed& crossed : bundle_crossed_) crossed.clear();
  const unsigned through = accel::cross_transparent(scene_.world, {std::span(bundle_).first(size), selves_.data()},
                                                    limit, bundle_crossed_.data());
  for (std::size_t k = 0; k < size; ++k) {
    const auto [at, transmittance] = of_[k];
    const bool is_through = (through >> k & 1) != 0;
    *transmittance = is_through ? through_items(bundle_crossed_[k].sorted()) : math::black;
    if (is_through && dot(at->facing, bundle_[k].direction) < 0)
      *transmittance = *transmittance * at->material->transmission;
  }
  counters_.rays.shadow += size;
  if (scene_.world.structure.wide) counters_.shadow_rays_bundled += size - 1;
}

}  // namespace penumbra::shading::shadows
