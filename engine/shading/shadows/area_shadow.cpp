#include <algorithm>

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

}  // namespace

bool leaves_on_outer_side(const ShadingPoint& at, const std::array<Vec3, 4>& corners) {
  return dot(at.facing, at.surface.normal) > 0 && (!at.material->transmits || is_well_above(at.facing, corners));
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
