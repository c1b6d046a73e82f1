#include "engine/shading/shadows.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>

#include "engine/math/error_free.h"

namespace penumbra::shading {
namespace {

using math::dot;

/// Where silhouettes have more edges than this, rays to as many points of the disc as the chords are worth cost less;
/// and sooner where triangles are finer than pixels, and no point is like the next.
constexpr std::size_t edges_per_chord = 32, fine_edges_per_chord = 4;

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
  return {mean, {halves.variance(order), {variance(mean.r), variance(mean.g), variance(mean.b)}}, false};
}

/// Whether all corners are above the horizon for certain.
bool is_well_above(const Vec3& facing, const std::array<Vec3, 4>& corners) {
  return std::ranges::all_of(
      corners, [&](const Vec3& corner) { return dot(facing, corner) > math::gamma(64) * math::length(corner); });
}

/// Whether every way to the corners that lets light through leaves the point's surface on its outer side.
bool leaves_on_outer_side(const ShadingPoint& at, const std::array<Vec3, 4>& corners) {
  return dot(at.facing, at.surface.normal) > 0 && (!at.material->transmits || is_well_above(at.facing, corners));
}

}  // namespace

Color Shadows::through_items(const std::vector<std::uint32_t>& items) const {
  Color product = math::white;
  for (const std::uint32_t item : items) product = product * scene_.materials[scene_.item_material[item]].transmission;
  return product;
}

void Shadows::aim(const ShadingPoint& at, std::size_t light, const accel::Target& target, bool is_disc) {
  const bool has_outline = is_disc && switches_.shadow_candidates;
  cell_ = switches_.light_cells ? cells_.find(at, light, target, has_outline) : nullptr;
}

bool Shadows::cross(const ShadingPoint& at, const Vec3& towards, double limit) {
  crossed_.clear();
  const geometry::Ray ray{leave_surface(at.surface, towards), towards, at.id};
  if (listed() == nullptr) {
    ++counters_.shadow;
    return accel::cross_transparent(scene_.world, ray, limit, crossed_);
  }
  ++counters_.shadow_rays_listed;
  return accel::cross_transparent(scene_.world, *cell_, ray, limit, crossed_);
}

Color Shadows::transmittance(const ShadingPoint& at, const Vec3& towards, double limit) {
  const bool is_behind = dot(at.facing, towards) < 0;
  if (is_behind && !at.material->transmits) return math::black;
  if (!is_behind && (shared() == Shared::lit || shared() == Shared::dark)) {
    ++(shared() == Shared::lit ? counters_.shadow_rays_lit : counters_.shadow_rays_dark);
    return shared() == Shared::lit ? math::white : math::black;
  }
  if (!cross(at, towards, limit)) return math::black;
  const Color product = through_items(crossed_.sorted());
  return is_behind ? product * own_surface(at) : product;
}

Shadows::Verdict Shadows::classify(const ShadingPoint& at, const std::array<Vec3, 4>& corners, std::uint32_t ignored) {
  if (!switches_.shadow_candidates) return Verdict::unknown;
  if (shared() == Shared::lit) return Verdict::lit;
  if (shared() == Shared::dark) return Verdict::dark;
  const Vec3 middle = (corners[0] + corners[1] + corners[2] + corners[3]) * 0.25;
  const Vec3 apex = leave_surface(at.surface, dot(at.facing, middle) < 0 ? -at.facing : at.facing);
  std::array<Vec3, 4> targets = corners;
  for (Vec3& corner : targets) corner += at.surface.position;
  candidates_.gather(scene_.world, accel::Shaft(apex, targets, false), at.id, leaves_on_outer_side(at, corners), cell_,
                     ignored);
  if (candidates_.is_dark()) return Verdict::dark;
  if (candidates_.is_incomplete()) return Verdict::unknown;
  return candidates_.is_empty() ? Verdict::lit : Verdict::listed;
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

Visibility Shadows::disc(const ShadingPoint& at, const SeenDisc& disc, const DiscSampling& sampling,
                         const sampling::Place& place) {
  const auto count = static_cast<std::uint64_t>(sampling.spiral.count());
  if (shared() == Shared::lit || shared() == Shared::dark) {
    (shared() == Shared::lit ? counters_.shadow_rays_lit : counters_.shadow_rays_dark) += count;
    return {shared() == Shared::lit ? math::white : math::black, {}, true};
  }
  const math::Frame frame = math::frame_around(disc.normal);
  const Vec3 &axis = disc.axis, u = frame.u * disc.radius, v = frame.v * disc.radius;
  const double limit = disc.is_infinite ? HUGE_VAL : 1;
  const sampling::Key key = place.key();
  if (switches_.shadow_candidates) {
    const double fu = dot(at.facing, u), fv = dot(at.facing, v);
    const double height = dot(at.facing, axis) - std::sqrt(fu * fu + fv * fv);
    const bool is_above_horizon = height > math::gamma(64) * math::length(axis);
    const auto is_seen = [&](double x, double y) { return cross(at, axis + u * x + v * y, limit); };
    const Vec3 from = leave_surface(at.surface, at.facing);
    const DiscView view{from, disc.is_infinite ? axis : axis - (from - at.surface.position), u, v, disc.is_infinite};
    const std::size_t edges_each = at.footprint > scene_.typical_edge ? fine_edges_per_chord : edges_per_chord;
    gather(at, view, is_above_horizon, edges_each * static_cast<std::size_t>(sampling.chords.count()));
    if (candidates_.is_dark()) {
      counters_.shadow_rays_dark += count;
      return {math::black, {}, true};
    }
    if (candidates_.is_empty() && is_above_horizon) {
      // Whatever triangles there are, one ray tells for all.
      const bool is_lit = !candidates_.has_opaque_triangles() || is_seen(0, 0);
      (is_lit ? counters_.shadow_rays_lit : counters_.shadow_rays_dark) += count;
      return {is_lit ? math::white : math::black, {}, true};
    }
    const Covers covers = candidates_.is_incomplete() || !switches_.shadow_outlines
                              ? Covers::unknown
                              : find_covers(at, view, !is_above_horizon);
    if (covers == Covers::dark) {
      counters_.shadow_rays_dark += count;
      return {math::black, {}, true};
    }
    if (covers == Covers::listed) {
      const double chords = sampling.chords.count();
      const sampling::Halves halves =
          sweep_.integrate(covers_, candidates_.silhouette(), candidates_.has_opaque_triangles(), sampling.chords,
                           key.uniform(0), key.uniform(1), is_seen);
      if (sweep_.is_certain()) {
        (halves.mean().r > 0 ? counters_.shadow_rays_lit : counters_.shadow_rays_dark) += count;
        return {halves.mean(), {}, true};
      }
      counters_.shadow_rays_covered += count;
      return with_variance(halves, sampling::Halves::chords(sampling.chords.count()), chord_variance, chords,
                           chords * chords * chords);
    }
  }
  const sampling::DiscSpiral::Turn turn = sampling::DiscSpiral::turn(key);
  sampling::Halves halves;  // every second point of the spiral makes a spiral again
  sample(at, axis, u, v, limit, sampling.spiral, turn);
  for (std::size_t i = 0; i < transmittances_.size(); ++i) halves.add(i % 2 == 1, transmittances_[i]);
  const double n = sampling.spiral.count();
  return with_variance(halves, sampling::Halves::points, spread_variance, n, n * std::sqrt(n));
}

void Shadows::sample(const ShadingPoint& at, const Vec3& axis, const Vec3& u, const Vec3& v, double limit,
                     const sampling::DiscSpiral& spiral, const sampling::DiscSpiral::Turn& turn) {
  const int count = spiral.count();
  transmittances_.resize(static_cast<std::size_t>(count));
  const auto towards = [&](int i) {
    const auto [x, y] = spiral.point(i, turn);
    return axis + u * x + v * y;
  };
  std::uint32_t taken = 0;
  const auto is_canceled = [&] { return ++taken % samples_between_looks == 0 && is_canceled_(); };
  if (!switches_.shadow_bundles || listed() != nullptr) {
    for (int i = 0; i < count && !is_canceled(); ++i)
      transmittances_[static_cast<std::size_t>(i)] = transmittance(at, towards(i), limit);
    return;
  }
  const Vec3& n = at.surface.normal;
  const Vec3 outside = leave_surface(at.surface, n), inside = leave_surface(at.surface, -n);
  std::array<int, accel::bundle_width> index;
  std::size_t size = 0;
  const auto cast = [&] {
    for (accel::Crossed& crossed : bundle_crossed_) crossed.clear();
    const unsigned through =
        accel::cross_transparent(scene_.world, std::span(bundle_).first(size), at.id, limit, bundle_crossed_.data());
    for (std::size_t k = 0; k < size; ++k) {
      Color& result = transmittances_[static_cast<std::size_t>(index[k])];
      if ((through >> k & 1) == 0) {
        result = math::black;
        continue;
      }
      result = through_items(bundle_crossed_[k].sorted());
      if (dot(at.facing, bundle_[k].direction) < 0) result = result * own_surface(at);
    }
    counters_.shadow += size;
    if (scene_.world.structure.wide) counters_.shadow_rays_bundled += size - 1;
    size = 0;
  };
  for (const int i : spiral.around()) {
    if (is_canceled()) return;
    const Vec3 direction = towards(i);
    if (dot(at.facing, direction) < 0 && !at.material->transmits) {
      transmittances_[static_cast<std::size_t>(i)] = math::black;
      continue;
    }
    std::construct_at(&bundle_[size], dot(direction, n) < 0 ? inside : outside, direction);
    index[size++] = i;
    if (size == accel::bundle_width) cast();
  }
  if (size > 0) cast();
}

void Shadows::gather(const ShadingPoint& at, const DiscView& view, bool is_above_horizon, std::size_t most_edges) {
  const Vec3 &axis = view.axis, &u = view.u, &v = view.v;
  std::array<Vec3, 4> corners{axis - u - v, axis + u - v, axis + u + v, axis - u + v};
  const bool leaves_self = leaves_on_outer_side(at, corners);
  if (!view.is_infinite) {
    for (Vec3& corner : corners) corner += view.from;
  }
  // Dual to u, v and axis.
  const double volume = 1 / dot(axis, math::cross(u, v));
  const accel::Projection projection{view.from,
                                     math::cross(v, axis) * volume,
                                     math::cross(axis, u) * volume,
                                     math::cross(u, v) * volume,
                                     view.is_infinite,
                                     at.surface.position,
                                     accel::ViewCone::around(axis, math::length(u), view.is_infinite)};
  const accel::Shaft shaft(view.from, corners, view.is_infinite, is_above_horizon ? at.facing : Vec3{});
  candidates_.gather_silhouettes(scene_.world, shaft, projection, at.id, leaves_self, cell_, most_edges);
  if (switches_.hidden_spheres && !candidates_.is_dark() && !candidates_.is_incomplete())
    counters_.hidden_spheres += candidates_.drop_hidden_spheres();
}

Shadows::Covers Shadows::find_covers(const ShadingPoint& at, const DiscView& view, bool has_horizon) {
  covers_.clear();
  const SphereCovers sphere_covers(view);
  for (const accel::SeenSphere& sphere : candidates_.spheres()) {
    if (!sphere_covers.append(sphere, covers_)) return Covers::unknown;
    const Extent extent = extent_of(covers_.back());
    if (extent == Extent::all) return Covers::dark;
    if (extent == Extent::none) covers_.pop_back();
  }
  // In scene order, whatever structure found them: products round the same way.
  const accel::World& world = scene_.world;
  for (const std::uint32_t place : candidates_.scene_order()) {
    const accel::Candidate& candidate = candidates_.list()[place];
    const std::uint32_t id = candidate.surface.item;
    const accel::Item& item = world.items[id];
    const std::size_t first = covers_.size();
    const auto in_item_space = [&] {
      return item.placement == accel::not_placed ? view
                                                 : view.in_space(world.placements[item.placement].world_to_local);
    };
    bool is_simple = false;
    int crossings = 1;
    if (candidate.is_triangle) {
      is_simple = append_cover(candidate.triangle, view, covers_);
    } else if (item.kind == accel::Kind::plane) {
      is_simple = append_cover(world.planes[item.index], view, covers_);
    } else if (item.kind == accel::Kind::sphere && id != at.id.item) {
      is_simple = append_cover(world.spheres[item.index], in_item_space(), covers_);
      crossings = 2;
    } else if (item.kind == accel::Kind::cylinder && id != at.id.item && candidate.is_opaque) {
      is_simple = append_cover(world.cylinders[item.index], in_item_space(), covers_);
    }
    if (!is_simple) return Covers::unknown;
    const Color& transmission = scene_.materials[scene_.item_material[id]].transmission;
    std::size_t kept = first;
    for (std::size_t i = first; i < covers_.size(); ++i) {
      const Extent extent = extent_of(covers_[i]);
      if (extent == Extent::none) continue;
      if (extent == Extent::all && candidate.is_opaque) return Covers::dark;
      if (kept < i) covers_[kept] = covers_[i];
      DiscCover& cover = covers_[kept++];
      cover.is_opaque = candidate.is_opaque;
      cover.is_whole = extent == Extent::all;
      cover.transmittance = crossings == 2 ? transmission * transmission : transmission;
    }
    covers_.resize(kept);
  }
  if (has_horizon) {
    covers_.push_back(cover_below_horizon(at.facing, view));
    covers_.back().is_opaque = !at.material->transmits;
    covers_.back().transmittance = own_surface(at);
  }
  return Covers::listed;
}

}  // namespace penumbra::shading
