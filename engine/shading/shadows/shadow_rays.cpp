#include <algorithm>
#include <cmath>

#include "engine/shading/shadows/shadows.h"

namespace penumbra::shading::shadows {

using math::dot;

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
  const sampling::DiscSpiral::Turn turn = sampling::DiscSpiral::turn(key);
  std::vector<Color>& transmittances = shadows_.transmittances_;
  transmittances.resize(static_cast<std::size_t>(sampling.spiral.count()));
  std::size_t taken = 0;
  for (const int i : sampling.spiral.around()) {
    if (++taken % samples_between_looks == 0 && shadows_.is_canceled_()) return shadows_.bundle_.clear(), Visibility{};
    const auto [x, y] = sampling.spiral.point(i, turn);
    Color& seen = transmittances[static_cast<std::size_t>(i)];
    if (listed() != nullptr) {
      seen = transmittance(disc.at(x, y), disc.limit());
    } else {
      shadows_.add_ray(at_, disc.at(x, y), disc.limit(), seen);
    }
  }
  shadows_.cast_bundle(disc.limit());
  return shadows_.mean_of(0, transmittances.size(), 1);
}

Visibility Shadows::mean_of(std::size_t first, std::size_t count, std::size_t stride, const Weights* weights) const {
  sampling::Halves halves;  // every second point of a spiral makes a spiral again
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t place = first + i * stride;
    const Color& seen = transmittances_[place];
    halves.add(i % 2 == 1, weights == nullptr ? seen : weights->usual + (seen - weights->usual) * weights->of[place]);
  }
  const auto n = static_cast<double>(count);
  Visibility mean = estimated(halves, sampling::Halves::points, spread_variance, n, n * std::sqrt(n));
  if (weights == nullptr) return mean;
  const auto within = [](double share) { return std::clamp(share, 0.0, 1.0); };
  mean.mean = {within(mean.mean.r), within(mean.mean.g), within(mean.mean.b)};
  return mean;
}

void Shadows::add_ray(const ShadingPoint& at, const Vec3& direction, double limit, Color& transmittance) {
  if (dot(at.facing, direction) < 0 && !at.material->transmits) {
    transmittance = math::black;
    return;
  }
  of_[bundle_.size()] = {&at, &transmittance};
  bundle_.add(leave_surface(at.surface, direction), direction, at.id);
  if (bundle_.size() == (switches_.shadow_bundles ? accel::bundle_width : 1)) cast_bundle(limit);
}

void Shadows::cast_bundle(double limit) {
  const std::size_t size = bundle_.size();
  if (size == 0) return;
  for (accel::Crossed& crossed : bundle_crossed_) crossed.clear();
  const unsigned through = accel::cross_transparent(scene_.world, bundle_, limit, bundle_crossed_.data());
  for (std::size_t k = 0; k < size; ++k) {
    const auto [at, transmittance] = of_[k];
    const bool is_through = (through >> k & 1) != 0;
    *transmittance = is_through ? through_items(bundle_crossed_[k].sorted()) : math::black;
    if (is_through && dot(at->facing, bundle_.direction(k)) < 0)
      *transmittance = *transmittance * at->material->transmission;
  }
  bundle_.clear();
  counters_.rays.shadow += size;
  if (scene_.world.structure.wide) counters_.shadow_rays_bundled += size - 1;
}

}  // namespace penumbra::shading::shadows
