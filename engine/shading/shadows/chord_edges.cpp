#include <algorithm>
#include <cmath>

#include "engine/shading/shadows/chord_sweep.h"

/// The edges in sight, and where they enter and leave the disc, or the largest square in it.
namespace penumbra::shading::shadows {
namespace {

using sampling::Point2;

Point2 in_plane(const Vec3& p) {
  const double inverse = 1 / p.z;
  return {p.x * inverse, p.y * inverse};
}

Point2 at(const Vec3& a, const Vec3& b, double t) { return in_plane(a + (b - a) * t); }

}  // namespace

bool ChordSweep::find_edges(Region region, std::span<const DiscCover> covers,
                            std::span<const SilhouetteEdge> silhouette) {
  region_ = region;
  region == Region::disc ? clip_to_disc(silhouette) : clip_to_square(silhouette);
  is_certain_ = edges_.empty() && std::ranges::all_of(covers, &DiscCover::is_whole);
  // In scene order, whatever structure found them: sums round the same way. Those of a cell come in order.
  if (!std::ranges::is_sorted(edges_, {}, &Edge::place)) std::ranges::sort(edges_, {}, &Edge::place);
  return is_certain_;
}

void ChordSweep::clip_to_square(std::span<const SilhouetteEdge> silhouette) {
  edges_.clear();
  for (const SilhouetteEdge& edge : silhouette) {
    const Vec3 &a = edge.from, &b = edge.to;
    double begin = 0, end = 1;
    bool enters = false, leaves = false;               // whatever the places are rounded to
    const auto clip = [&](double at_a, double at_b) {  // to where this is not negative
      if (at_a < 0 && at_b < 0) end = -1;
      if (at_a < 0 && at_b >= 0) enters = true, begin = std::max(begin, at_a / (at_a - at_b));
      if (at_a >= 0 && at_b < 0) leaves = true, end = std::min(end, at_a / (at_a - at_b));
    };
    clip(a.z * half_square - a.x, b.z * half_square - b.x), clip(a.z * half_square + a.x, b.z * half_square + b.x);
    clip(a.z * half_square - a.y, b.z * half_square - b.y), clip(a.z * half_square + a.y, b.z * half_square + b.y);
    if (!(begin <= end)) continue;  // one that only just reaches in or out pierces the rim all the same
    edges_.push_back({enters ? at(a, b, begin) : in_plane(a), leaves ? at(a, b, end) : in_plane(b), enters, leaves,
                      edge.jump, edge.place});
  }
}

void ChordSweep::clip_to_disc(std::span<const SilhouetteEdge> silhouette) {
  edges_.clear();
  const auto is_inside = [](const Vec3& p) { return p.z > 0 && p.x * p.x + p.y * p.y < p.z * p.z; };
  for (const SilhouetteEdge& edge : silhouette) {
    const Vec3 &a = edge.from, &b = edge.to;
    const bool from_inside = is_inside(a), to_inside = is_inside(b);
    if (from_inside && to_inside) {
      edges_.push_back({in_plane(a), in_plane(b), false, false, edge.jump, edge.place});
      continue;
    }
    const RimMeetings rim = meet_rim(a, b);
    if (!rim.exist) continue;
    if (from_inside) {
      const double t = rim.first > 0 ? rim.first : rim.second;
      edges_.push_back({in_plane(a), at(a, b, std::clamp(t, 0.0, 1.0)), false, true, edge.jump, edge.place});
    } else if (to_inside) {
      const double t = rim.second < 1 ? rim.second : rim.first;
      edges_.push_back({at(a, b, std::clamp(t, 0.0, 1.0)), in_plane(b), true, false, edge.jump, edge.place});
    } else if (rim.first > 0 && rim.second < 1 && is_inside(a + (b - a) * (0.5 * (rim.first + rim.second)))) {
      edges_.push_back({at(a, b, rim.first), at(a, b, rim.second), true, true, edge.jump, edge.place});
    }
  }
}

ChordSweep::Span ChordSweep::Frame::across_square(double offset) const {
  Span span{-2, 2};
  const auto clip = [&](double at, double step) {  // to |at + t·step| ≤ half_square
    if (step == 0) return;
    const double from = (-half_square - at) / step, to = (half_square - at) / step;
    span.begin = std::max(span.begin, std::min(from, to)), span.end = std::min(span.end, std::max(from, to));
  };
  clip(offset * across.x, along.x), clip(offset * across.y, along.y);
  return span;
}

}  // namespace penumbra::shading::shadows
