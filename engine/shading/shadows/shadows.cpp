#include "engine/shading/shadows/shadows.h"

#include <algorithm>
#include <cmath>

#include "engine/math/error_free.h"
#include "engine/shading/shadows/meeting.h"

namespace penumbra::shading::shadows {
namespace {

using math::dot;

/// Where silhouettes have more edges than this, rays to as many points of the disc as the chords are worth cost less;
/// and sooner where triangles are finer than pixels, and no point is like the next.
constexpr std::size_t edges_per_chord = 32, fine_edges_per_chord = 4;

/// Of a ball around an ellipse of these half-axes.
double radius_around(const Vec3& u, const Vec3& v) {
  const double a = dot(u, u), b = dot(u, v), c = dot(v, v);
  // The larger eigenvalue of the half-axes' products; a circle's is all but exact.
  return std::sqrt(0.5 * (a + c + std::sqrt((a - c) * (a - c) + 4 * b * b)));
}

}  // namespace

Sight Shadows::aim(const ShadingPoint& at, std::size_t light, const Target& target, const DiscSampling& of_disc) {
  // Few rays cost less than to ask.
  if (are_few(at, of_disc)) return {*this, at, nullptr};
  return aim(at, light, target, true);
}

Sight Shadows::aim(const ShadingPoint& at, std::size_t light, const Target& target, bool has_outline) {
  const CellContents* cell =
      switches_.light_cells ? cells_.find(at, light, target, has_outline && switches_.shadow_candidates) : nullptr;
  if (cell != nullptr && cell->tells_something()) ++counters_.lights_from_cells;
  return {*this, at, cell};
}

Visibility Sight::disc(const SeenDisc& disc, const DiscSampling& sampling, const sampling::Place& place) {
  if (shared() == Shared::lit || shared() == Shared::dark) return all(shared() == Shared::lit, sampling);
  const DiscView from_point = view_of(disc);
  const Vec3 &u = from_point.u, &v = from_point.v;
  const sampling::Key key = place.key();
  if (shadows_.samples_alone(at_, sampling)) return sample(from_point, sampling, key);

  const double fu = dot(at_.facing, u), fv = dot(at_.facing, v);
  const double height = dot(at_.facing, disc.axis) - std::sqrt(fu * fu + fv * fv);
  const bool is_above_horizon = height > math::gamma(64) * math::length(disc.axis);
  const Vec3 from = leave_surface(at_.surface, at_.facing);
  const DiscView view{from, disc.is_infinite ? disc.axis : disc.axis - (from - at_.surface.position), u, v,
                      disc.is_infinite};
  gather(view, accel::no_item, is_above_horizon, most_edges(sampling));
  const Candidates& candidates = shadows_.candidates_;
  const auto told = [&](const Visibility& visibility) {
    ++counters_.lights_from_candidates;
    return visibility;
  };
  if (candidates.is_dark()) return told(all(false, sampling));
  // Whatever triangles there are, one ray tells for all.
  if (candidates.is_empty() && is_above_horizon)
    return told(all(!candidates.has_opaque_triangles() || cross(disc.axis, disc.limit()), sampling));
  const Covers covers = candidates.is_incomplete() || !shadows_.switches_.shadow_outlines
                            ? Covers::unknown
                            : find_covers(view, !is_above_horizon);
  if (covers == Covers::dark) return told(all(false, sampling));
  if (covers == Covers::listed) return told(sweep(disc, view, sampling, key));
  return sample(from_point, sampling, key);
}

DiscView Sight::view_of(const SeenDisc& disc) const {
  const math::Frame frame = math::frame_around(disc.normal);
  return {at_.surface.position, disc.axis, frame.u * disc.radius, frame.v * disc.radius, disc.is_infinite};
}

Visibility Sight::all(bool is_lit, const DiscSampling& sampling) {
  (is_lit ? counters_.shadow_rays_lit : counters_.shadow_rays_dark) +=
      static_cast<std::uint64_t>(sampling.spiral.count());
  return {is_lit ? math::white : math::black, {}, true};
}

Visibility Sight::sweep(const SeenDisc& disc, const DiscView& view, const DiscSampling& sampling,
                        const sampling::Key& key) {
  const Candidates& candidates = shadows_.candidates_;
  const auto is_seen = [&](double x, double y) { return cross(disc.axis + view.u * x + view.v * y, disc.limit()); };
  const sampling::Halves halves =
      shadows_.sweep_.integrate(shadows_.covers_, candidates.silhouette(), candidates.has_opaque_triangles(),
                                sampling.chords, key.uniform(0), key.uniform(1), is_seen);
  const auto count = static_cast<std::uint64_t>(sampling.spiral.count());
  if (shadows_.sweep_.is_certain()) {
    (halves.mean().r > 0 ? counters_.shadow_rays_lit : counters_.shadow_rays_dark) += count;
    return {halves.mean(), {}, true};
  }
  counters_.shadow_rays_covered += count;
  const double chords = sampling.chords.count();
  return estimated(halves, sampling::Halves::chords(sampling.chords.count()), chord_variance, chords,
                   chords * chords * chords);
}

std::size_t Sight::most_edges(const DiscSampling& sampling) const {
  const std::size_t each = at_.footprint > scene_.typical_edge ? fine_edges_per_chord : edges_per_chord;
  return each * static_cast<std::size_t>(sampling.chords.count());
}

void Sight::gather(const DiscView& view, std::uint32_t ignored, bool is_above_horizon, std::size_t most_edges) {
  const Vec3 &axis = view.axis, &u = view.u, &v = view.v;
  std::array<Vec3, 4> corners{axis - u - v, axis + u - v, axis + u + v, axis - u + v};
  const bool leaves_self = leaves_on_outer_side(at_, corners);
  if (!view.is_infinite) {
    for (Vec3& corner : corners) corner += view.from;
  }
  // Dual to u, v and axis.
  const double volume = 1 / dot(axis, math::cross(u, v));
  const double rounding = 2 * math::taxicab(view.from - at_.surface.position);
  const Projection projection{view.from,
                              math::cross(v, axis) * volume,
                              math::cross(axis, u) * volume,
                              math::cross(u, v) * volume,
                              view.is_infinite,
                              rounding,
                              ViewCone::around(axis, radius_around(u, v), view.is_infinite)};
  const Shaft shaft({view.from, rounding}, corners, view.is_infinite, is_above_horizon ? at_.facing : Vec3{});
  Candidates& candidates = shadows_.candidates_;
  candidates.gather_silhouettes(scene_.world, shaft, projection, at_.id, leaves_self, cell_, most_edges, ignored);
  if (shadows_.switches_.hidden_spheres && !candidates.is_dark() && !candidates.is_incomplete())
    counters_.hidden_spheres += candidates.drop_hidden_spheres();
}

Sight::Covers Sight::find_covers(const DiscView& view, bool has_horizon) {
  std::vector<DiscCover>& covers = shadows_.covers_;
  covers.clear();
  const SphereCovers sphere_covers(view);
  for (const SeenSphere& sphere : shadows_.candidates_.spheres()) {
    if (!sphere_covers.append(sphere, covers)) {
      if (meets_segments(view, scene_.world, scene_.world.items[sphere.item])) return Covers::unknown;
      continue;
    }
    const Extent extent = extent_of(covers.back());
    if (extent == Extent::all) return Covers::dark;
    if (extent == Extent::none) covers.pop_back();
  }
  // In scene order, whatever structure found them: products round the same way.
  for (const std::uint32_t place : shadows_.candidates_.scene_order()) {
    const Covers found = append_covers(shadows_.candidates_.list()[place], view);
    if (found != Covers::listed) return found;
  }
  if (has_horizon) {
    covers.push_back(cover_below_horizon(at_.facing, view));
    covers.back().is_opaque = !at_.material->transmits;
    covers.back().transmittance = own_surface();
  }
  return Covers::listed;
}

Sight::Covers Sight::append_covers(const Candidate& candidate, const DiscView& view) {
  const accel::World& world = scene_.world;
  std::vector<DiscCover>& covers = shadows_.covers_;
  const std::uint32_t id = candidate.surface.item;
  const accel::Item& item = world.items[id];
  const std::size_t first = covers.size();
  const auto in_item_space = [&] {
    return item.placement == accel::no_placement ? view
                                                 : view.in_space(world.placements[item.placement].world_to_local);
  };
  const bool is_self = id == at_.id.item;
  bool is_simple = false;
  int crossings = 1;
  switch (item.kind) {
    case accel::Kind::patch:
    case accel::Kind::mesh:
      is_simple = append_cover(candidate.triangle, view, covers);
      break;
    case accel::Kind::plane:
      is_simple = append_cover(world.planes[item.index], view, covers);
      break;
    case accel::Kind::sphere:
      is_simple = !is_self && append_cover(world.spheres[item.index], in_item_space(), covers);
      crossings = 2;
      break;
    case accel::Kind::cylinder:
      is_simple = !is_self && candidate.is_opaque && append_cover(world.cylinders[item.index], in_item_space(), covers);
      break;
    case accel::Kind::tube:
      break;
  }
  if (!is_simple) return meets_segments(view, world, item) ? Covers::unknown : Covers::listed;
  const Color& transmission = scene_.materials[scene_.item_material[id]].transmission;
  std::size_t kept = first;
  for (std::size_t i = first; i < covers.size(); ++i) {
    const Extent extent = extent_of(covers[i]);
    if (extent == Extent::none) continue;
    if (extent == Extent::all && candidate.is_opaque) return Covers::dark;
    if (kept < i) covers[kept] = covers[i];
    DiscCover& cover = covers[kept++];
    cover.is_opaque = candidate.is_opaque;
    cover.is_whole = extent == Extent::all;
    cover.transmittance = crossings == 2 ? transmission * transmission : transmission;
  }
  covers.resize(kept);
  return Covers::listed;
}

}  // namespace penumbra::shading::shadows
