#include <algorithm>
#include <cmath>

#include "engine/math/error_free.h"
#include "engine/shading/shadows/shadows.h"

namespace penumbra::shading::shadows {

using math::dot;

namespace {

/// Whether all corners are above the horizon for certain.
bool is_well_above(const Vec3& facing, const std::array<Vec3, 4>& corners) {
  return std::ranges::all_of(
      corners, [&](const Vec3& corner) { return dot(facing, corner) > math::gamma(64) * math::length(corner); });
}

ChordSweep::Region region_of(const SeenArea& area) {
  return area.is_round ? ChordSweep::Region::disc : ChordSweep::Region::square;
}

}  // namespace

bool leaves_on_outer_side(const ShadingPoint& at, const std::array<Vec3, 4>& corners) {
  return dot(at.facing, at.surface.normal) > 0 && (!at.material->transmits || is_well_above(at.facing, corners));
}

double SeenArea::limit(const Vec3& towards) const {
  if (!is_round) return 1;
  const double squared = dot(towards, towards), middle = dot(center, towards) / squared;
  const Vec3 across = center - towards * middle;
  constexpr double before = 1 - 0x1p-40;  // a lamp that shows the light
  return before * (middle - std::sqrt(std::max(0.0, radius * radius - dot(across, across)) / squared));
}

Sight::Verdict Sight::trace(const SeenArea& area, const DiscSampling& sampling, const sampling::Key& key) {
  if (!shadows_.switches_.shadow_candidates || !shadows_.switches_.shadow_outlines) return Verdict::unknown;
  if (shared() == Shared::lit) return Verdict::lit;
  if (shared() == Shared::dark) return Verdict::dark;
  // The disc around a parallelogram.
  const double scale = area.is_round ? 1 : std::sqrt(2.0);
  const Vec3 &axis = area.axis, u = area.u * scale, v = area.v * scale;
  const bool is_above = is_well_above(
      at_.facing, {axis - area.u - area.v, axis + area.u - area.v, axis + area.u + area.v, axis - area.u + area.v});
  const Vec3 from = leave_surface(at_.surface, at_.facing);
  const DiscView view{from, axis - (from - at_.surface.position), u, v, false};
  // Rays to an area light go alone, and each tells of its own direction: they cost more than those to a disc.
  constexpr std::size_t least_edges = 1024;
  gather(view, area.ignored, is_above, std::max(least_edges, most_edges(sampling)));
  const Candidates& candidates = shadows_.candidates_;
  const auto told = [&](Verdict verdict) {
    ++counters_.lights_from_candidates;
    return verdict;
  };
  if (candidates.is_dark()) return told(Verdict::dark);
  if (candidates.is_incomplete()) return Verdict::unknown;
  if (is_above && candidates.is_empty() && !candidates.has_opaque_triangles()) return told(Verdict::lit);
  const Covers covers = find_covers(view, false);
  if (covers == Covers::unknown) return Verdict::unknown;
  if (covers == Covers::dark) return told(Verdict::dark);
  if (!is_above) shadows_.covers_.push_back(cover_below_horizon(at_.facing, view));
  const auto is_seen = [&](double x, double y) {
    const Vec3 towards = axis + u * x + v * y;
    return cross(towards, area.limit(towards));
  };
  shadows_.sweep_.trace(region_of(area), shadows_.covers_, candidates.silhouette(), candidates.has_opaque_triangles(),
                        sampling.chords, key.uniform(0), key.uniform(1), is_seen);
  const auto parts = open_parts();
  if (parts.empty()) return told(Verdict::dark);
  if (!shadows_.sweep_.is_certain() || !(parts.front().transmittance == math::white)) return told(Verdict::listed);
  return told(Verdict::lit);
}

void Sight::trace_open(const SeenArea& area, const DiscSampling& sampling, const sampling::Key& key) {
  shadows_.sweep_.trace(region_of(area), {}, {}, false, sampling.chords, key.uniform(0), key.uniform(1), {});
}

LightLine Sight::line(const SeenArea& area, std::size_t index) const {
  const ChordSweep::Line& line = shadows_.sweep_.lines()[index];
  const double scale = area.is_round ? 1 : std::sqrt(2.0);
  const auto in_space = [&](double x, double y) { return area.u * (x * scale) + area.v * (y * scale); };
  const double x = line.to.x - line.from.x, y = line.to.y - line.from.y;
  const Vec3 along = in_space(x, y), across = in_space(-y, x) * (1 / std::sqrt(x * x + y * y));
  const double strip = math::length(math::cross(along, across)) / math::length(along);
  return {area.axis + in_space(line.from.x, line.from.y), along, line.width * strip, line.is_second};
}

Sight::Verdict Sight::classify(const std::array<Vec3, 4>& corners, std::uint32_t ignored) {
  if (!shadows_.switches_.shadow_candidates) return Verdict::unknown;
  if (shared() == Shared::lit) return Verdict::lit;
  if (shared() == Shared::dark) return Verdict::dark;
  const Vec3 middle = (corners[0] + corners[1] + corners[2] + corners[3]) * 0.25;
  const Vec3 apex = leave_surface(at_.surface, dot(at_.facing, middle) < 0 ? -at_.facing : at_.facing);
  std::array<Vec3, 4> targets = corners;
  for (Vec3& corner : targets) corner += at_.surface.position;
  Candidates& candidates = shadows_.candidates_;
  candidates.gather(scene_.world, Shaft({apex, 2 * math::taxicab(apex - at_.surface.position)}, targets, false), at_.id,
                    leaves_on_outer_side(at_, corners), cell_, ignored);
  if (candidates.is_incomplete()) return Verdict::unknown;
  ++counters_.lights_from_candidates;
  if (candidates.is_dark()) return Verdict::dark;
  return candidates.is_empty() ? Verdict::lit : Verdict::listed;
}

Color Sight::transmittance_of_sample(Verdict verdict, const Vec3& towards, double limit) {
  if (verdict == Verdict::unknown) return transmittance(towards, limit);
  const bool is_behind = dot(at_.facing, towards) < 0;
  if (is_behind && !at_.material->transmits) return math::black;
  const Color own = is_behind ? own_surface() : math::white;
  if (verdict == Verdict::lit) {
    ++counters_.shadow_rays_lit;
    return own;
  }
  ++counters_.shadow_rays_listed;
  const geometry::Ray ray{leave_surface(at_.surface, towards), towards, at_.id};
  const geometry::PreparedRay prepared(ray.origin, ray.direction);
  accel::Crossed& crossed = shadows_.crossed_;
  crossed.clear();
  for (const Candidate& candidate : shadows_.candidates_.list()) {
    const int count = candidate.is_triangle ? static_cast<int>(crosses(candidate.triangle, prepared, limit))
                                            : accel::count_crossings(scene_.world, candidate.surface.item, ray, limit);
    if (count > 0 && candidate.is_opaque) return math::black;
    for (int i = 0; i < count; ++i) crossed.add(candidate.surface.item);
  }
  return own * shadows_.through_items(crossed.sorted());
}

}  // namespace penumbra::shading::shadows
