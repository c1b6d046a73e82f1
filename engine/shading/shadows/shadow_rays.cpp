#include <cmath>
#include <memory>
#include <span>

#include "engine/shading/shadows/shadows.h"

namespace penumbra::shading::shadows {

using math::dot;

Color Sight::through_items(const std::vector<std::uint32_t>& items) const {
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
  const Color product = through_items(shadows_.crossed_.sorted());
  return is_behind ? product * own_surface() : product;
}

void Sight::cast(const DiscView& disc, const DiscSampling& sampling, const sampling::DiscSpiral::Turn& turn) {
  shadows_.transmittances_.resize(static_cast<std::size_t>(sampling.spiral.count()));
  if (shadows_.switches_.shadow_bundles && listed() == nullptr) return cast_bundles(disc, sampling.spiral, turn);
  std::uint32_t taken = 0;
  for (Color& result : shadows_.transmittances_) {
    const auto [x, y] = sampling.spiral.point(static_cast<int>(taken), turn);
    if (++taken % samples_between_looks == 0 && shadows_.is_canceled_()) return;
    result = transmittance(disc.at(x, y), disc.limit());
  }
}

void Sight::cast_bundles(const DiscView& disc, const sampling::DiscSpiral& spiral,
                         const sampling::DiscSpiral::Turn& turn) {
  const Vec3& n = at_.surface.normal;
  const Vec3 outside = leave_surface(at_.surface, n), inside = leave_surface(at_.surface, -n);
  std::array<int, accel::bundle_width> index;
  std::size_t size = 0;
  std::uint32_t taken = 0;
  for (const int i : spiral.around()) {
    if (++taken % samples_between_looks == 0 && shadows_.is_canceled_()) return;
    const auto [x, y] = spiral.point(i, turn);
    const Vec3 direction = disc.at(x, y);
    if (dot(at_.facing, direction) < 0 && !at_.material->transmits) {
      shadows_.transmittances_[static_cast<std::size_t>(i)] = math::black;
      continue;
    }
    std::construct_at(&shadows_.bundle_[size], dot(direction, n) < 0 ? inside : outside, direction);
    index[size++] = i;
    if (size == accel::bundle_width) cast_bundle(size, disc.limit(), index), size = 0;
  }
  if (size > 0) cast_bundle(size, disc.limit(), index);
}

void Sight::cast_bundle(std::size_t size, double limit, const std::array<int, accel::bundle_width>& index) {
  for (accel::Crossed& crossed : shadows_.bundle_crossed_) crossed.clear();
  const unsigned through = accel::cross_transparent(scene_.world, std::span(shadows_.bundle_).first(size), at_.id,
                                                    limit, shadows_.bundle_crossed_.data());
  for (std::size_t k = 0; k < size; ++k) {
    Color& result = shadows_.transmittances_[static_cast<std::size_t>(index[k])];
    if ((through >> k & 1) == 0) {
      result = math::black;
      continue;
    }
    result = through_items(shadows_.bundle_crossed_[k].sorted());
    if (dot(at_.facing, shadows_.bundle_[k].direction) < 0) result = result * own_surface();
  }
  counters_.rays.shadow += size;
  if (scene_.world.structure.wide) counters_.shadow_rays_bundled += size - 1;
}

}  // namespace penumbra::shading::shadows
