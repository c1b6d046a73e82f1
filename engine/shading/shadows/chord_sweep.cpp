#include "engine/shading/shadows/chord_sweep.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/math/elementary.h"
#include "engine/shading/shadows/cover_chords.h"

namespace penumbra::shading::shadows {
namespace {

using sampling::Point2;

// Of a chord's half: shorter parts are the rounding of edges that meet, and tell nothing of what is in line there.
constexpr double shortest_part = 1e-9;
// Of the disc's radius: less of an edge in sight does not turn the chords.
constexpr double noticeable = 1e-4;

Point2 in_plane(const Vec3& p) {
  const double inverse = 1 / p.z;
  return {p.x * inverse, p.y * inverse};
}

Point2 at(const Vec3& a, const Vec3& b, double t) { return in_plane(a + (b - a) * t); }

Point2 turned_point(const Point2& p, const Point2& along, const Point2& across) {
  return {p.x * along.x + p.y * along.y, p.x * across.x + p.y * across.y};
}

/// Narrows [begin, end] to where a·t² + 2b·t + c ≥ 0 with a ≥ 0, which is convex there: one branch of a hyperbola is
/// inside a cone, the other inside its mirror image, which edges[0] ≥ 0 has cut off if it comes near the disc.
void clip_to_hyperbola(double a, double b, double c, double& begin, double& end) {
  const auto is_inside = [&](double t) { return (a * t + 2 * b) * t + c >= 0; };
  const double discriminant = b * b - a * c;
  if (!(discriminant > 0) || a == 0) {
    if (!is_inside(0.5 * (begin + end))) end = begin;
    return;
  }
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  double low = q / a, high = q != 0 ? c / q : -low;
  if (low > high) std::swap(low, high);
  if (low > begin && high < end) {
    (is_inside(0.5 * (begin + low)) ? end : begin) = is_inside(0.5 * (begin + low)) ? low : high;
  } else if (low > begin && low < end) {
    end = low;
  } else if (high > begin && high < end) {
    begin = high;
  } else if (!is_inside(0.5 * (begin + end))) {
    end = begin;
  }
}

}  // namespace

Linear ChordSweep::Frame::turned(const Linear& f) const {
  return {f.a, f.b * across.x + f.c * across.y, f.b * along.x + f.c * along.y};
}

Quadratic ChordSweep::Frame::turned(const Quadratic& q) const {
  const auto form = [&](const Point2& p, const Point2& r) {
    return q.d * p.x * r.x + q.e * (p.x * r.y + p.y * r.x) + q.f * p.y * r.y;
  };
  return {q.a,
          q.b * across.x + q.c * across.y,
          q.b * along.x + q.c * along.y,
          form(across, across),
          form(across, along),
          form(along, along)};
}

void ChordSweep::clip(std::span<const SilhouetteEdge> silhouette) {
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

/// Chords cross an edge at right angles best. The direction that most edges in sight agree on is the main axis of the
/// sum of their normals' tensors.
ChordSweep::Frame ChordSweep::choose_frame(std::span<const DiscCover> covers, double turn) const {
  double xx = 0, xy = 0, yy = 0;
  for (const DiscCover& cover : covers) {
    for (std::size_t i = 0; i < cover.edge_count && !cover.is_round; ++i) {
      const Linear& f = cover.edges[i];
      const double weight = length_in_disc(cover, i) / (f.b * f.b + f.c * f.c);
      if (!(weight > 0)) continue;
      xx += weight * f.b * f.b, xy += weight * f.b * f.c, yy += weight * f.c * f.c;
    }
  }
  for (const Edge& edge : edges_) {
    const double dx = edge.to.x - edge.from.x, dy = edge.to.y - edge.from.y;
    const double squared = dx * dx + dy * dy;
    if (!(squared > 0)) continue;
    const double weight = 1 / std::sqrt(squared);  // the tensor of unit normals, times the length
    xx += weight * dy * dy, xy -= weight * dx * dy, yy += weight * dx * dx;
  }
  const double difference = xx - yy, size = std::sqrt(difference * difference + 4 * xy * xy);
  // What is shorter than `noticeable` may be rounding.
  if (!(size > 0.05 * (xx + yy) + noticeable)) {
    const auto [sine, cosine] = math::sine_cosine_turns(turn);
    return {{-sine, cosine}, {cosine, sine}};
  }
  // Half of the double angle (difference, 2xy).
  const double c = std::sqrt(std::max(0.0, 0.5 * (1 + difference / size)));
  const double s = std::copysign(std::sqrt(std::max(0.0, 0.5 * (1 - difference / size))), xy);
  return {{-s, c}, {c, s}};
}

void ChordSweep::place_chords(const sampling::DiscChords& chords, double shift) {
  count_ = static_cast<std::size_t>(chords.count());
  if (chords_.size() < count_) chords_.resize(count_);
  open_count_ = 0;
  const std::size_t padded = (count_ + 3) / 4 * 4;
  if (offset_.size() != padded) {
    for (std::vector<double>* lanes : {&offset_, &open_begin_, &open_end_, &cover_begin_, &cover_end_})
      lanes->assign(padded, 0);
    cover_hits_.assign((padded + 7) / 8, 0);
  }
  const sampling::DiscChords::Shift shifted = chords.shifted(shift);
  for (std::size_t k = 0; k < count_; ++k) {
    const auto [offset, half_length, weight] = chords.chord(chords.count() - 1 - static_cast<int>(k), shifted);
    Chord& chord = chords_[k];
    chord.half_length = half_length, chord.weight = weight, chord.depth = 0;
    open_count_ += half_length > 0 ? 1 : 0;
    offset_[k] = offset, open_begin_[k] = -half_length, open_end_[k] = half_length;
    chord.crossings.clear(), chord.opaque.clear(), chord.clear.clear();
  }
}

/// How many chords have a lesser offset. Few are counted, without a branch.
std::size_t ChordSweep::first_chord_from(double offset) const {
  constexpr std::size_t few = 16;
  if (count_ <= few) {
    std::size_t below = 0;
    for (std::size_t k = 0; k < count_; ++k) below += offset_[k] < offset ? 1 : 0;
    return below;
  }
  const auto begin = offset_.begin();
  return static_cast<std::size_t>(std::lower_bound(begin, begin + static_cast<std::ptrdiff_t>(count_), offset) - begin);
}

void ChordSweep::add(const Edge& edge, const Frame& frame) {
  Point2 a = turned_point(edge.from, frame.along, frame.across), b = turned_point(edge.to, frame.along, frame.across);
  bool enters = edge.enters, leaves = edge.leaves;
  int jump = edge.jump;
  if (a.y > b.y) std::swap(a, b), std::swap(enters, leaves), jump = -jump;
  // Chords from one on: those not below a.y, and not below b.y.
  const std::size_t begin = first_chord_from(a.y), end = first_chord_from(b.y);
  if (begin < end) {
    const double slope = (b.x - a.x) / (b.y - a.y);
    for (std::size_t k = begin; k < end; ++k) chords_[k].crossings.push_back({a.x + (offset_[k] - a.y) * slope, jump});
  }
  // Where an edge pierces the left half of the rim, chords above begin on its other side.
  if (enters && a.x < 0) {
    for (std::size_t k = begin; k < count_; ++k) chords_[k].depth -= jump;
  }
  if (leaves && b.x < 0) {
    for (std::size_t k = end; k < count_; ++k) chords_[k].depth += jump;
  }
}

void ChordSweep::add(const DiscCover& cover, const Frame& frame) {
  std::array<Linear, 4> edges;
  for (std::size_t i = 0; i < cover.edge_count; ++i) edges[i] = frame.turned(cover.edges[i]);
  const Quadratic q = cover.is_round ? frame.turned(cover.round) : Quadratic{};
  clip_to_cover(std::span(edges).first(cover.edge_count), q.f < 0 ? &q : nullptr,
                {offset_.data(), open_begin_.data(), open_end_.data(), offset_.size()},
                {cover_begin_.data(), cover_end_.data(), cover_hits_.data()});
  for (std::size_t byte = 0; byte < cover_hits_.size(); ++byte) {
    for (unsigned hits = cover_hits_[byte]; hits != 0; hits &= hits - 1) {
      const std::size_t k = 8 * byte + static_cast<std::size_t>(std::countr_zero(hits));
      double begin = cover_begin_[k], end = cover_end_[k];
      if (cover.is_round && !(q.f < 0)) {
        const double s = offset_[k];
        clip_to_hyperbola(q.f, q.c + q.e * s, q.a + (2 * q.b + q.d * s) * s, begin, end);
        if (!(begin < end)) continue;
      }
      hide(k, {begin, end, &cover});
    }
  }
}

/// What is hidden at an end of the chord need not be looked at again.
void ChordSweep::hide(std::size_t chord, const Interval& interval) {
  double &begin = open_begin_[chord], &end = open_end_[chord];
  if (!(begin < end)) return;
  if (interval.cover != nullptr && !interval.cover->is_opaque) {
    chords_[chord].clear.push_back(interval);
    return;
  }
  if (interval.begin > begin && interval.end < end) {
    chords_[chord].opaque.push_back(interval);
    return;
  }
  if (interval.begin <= begin) begin = std::max(begin, interval.end);
  if (interval.end >= end) end = std::min(end, interval.begin);
  if (!(begin < end)) --open_count_;
}

void ChordSweep::hide_behind_triangles() {
  int least = std::numeric_limits<int>::max();
  for (std::size_t k = 0; k < count_; ++k) {
    Chord& chord = chords_[k];
    std::sort(chord.crossings.begin(), chord.crossings.end(),
              [](const Crossing& a, const Crossing& b) { return a.at != b.at ? a.at < b.at : a.jump < b.jump; });
    int depth = chord.depth;
    double from = -chord.half_length;
    const double shortest = shortest_part * chord.half_length;
    for (Crossing& crossing : chord.crossings) {
      crossing.at = std::clamp(crossing.at, -chord.half_length, chord.half_length);
      if (crossing.at - from > shortest) least = std::min(least, depth);
      depth += crossing.jump, from = crossing.at;
    }
    if (chord.half_length - from > shortest) least = std::min(least, depth);
  }
  for (std::size_t k = 0; k < count_; ++k) {
    Chord& chord = chords_[k];
    int depth = chord.depth;
    double from = -chord.half_length;
    const auto hide_until = [&](double end) {
      if (depth > least && end > from) hide(k, {from, end, nullptr});
      from = end;
    };
    for (const Crossing& crossing : chord.crossings) {
      hide_until(crossing.at);
      depth += crossing.jump;
    }
    hide_until(chord.half_length);
  }
}

void ChordSweep::light(std::size_t index, const Frame& frame, OpenPlace& longest) {
  Chord& chord = chords_[index];
  Color sum;
  const auto add_open = [&](double begin, double end) {
    if (end - begin > longest.length) {
      const double middle = 0.5 * (begin + end);
      longest = {offset_[index] * frame.across.x + middle * frame.along.x,
                 offset_[index] * frame.across.y + middle * frame.along.y, end - begin};
    }
    if (chord.clear.empty()) {
      sum += math::grey(end - begin);
      return;
    }
    // Between two neighbouring ends of intervals the product of transmittances is constant.
    for (double place = begin; place < end;) {
      double next = end;
      Color product = math::white;
      for (const Interval& interval : chord.clear) {
        if (interval.begin > place) next = std::min(next, interval.begin);
        if (interval.begin <= place && place < interval.end) {
          next = std::min(next, interval.end);
          product = product * interval.cover->transmittance;
        }
      }
      sum += product * (next - place);
      place = next;
    }
  };
  std::sort(chord.opaque.begin(), chord.opaque.end(),
            [](const Interval& a, const Interval& b) { return a.begin < b.begin; });
  double open_from = open_begin_[index];
  for (const Interval& interval : chord.opaque) {
    const double open_until = std::min(interval.begin, open_end_[index]);
    if (open_until > open_from) add_open(open_from, open_until);
    open_from = std::max(open_from, interval.end);
  }
  if (open_from < open_end_[index]) add_open(open_from, open_end_[index]);
  chord.lit = sum * (1 / (2 * chord.half_length));
}

sampling::Halves ChordSweep::integrate(std::span<const DiscCover> covers, std::span<const SilhouetteEdge> silhouette,
                                       bool has_triangles, const sampling::DiscChords& chords, double turn,
                                       double shift, const Probe& probe) {
  clip(silhouette);
  is_certain_ = edges_.empty() && std::ranges::all_of(covers, &DiscCover::is_whole);
  sampling::Halves halves;
  if (is_certain_) {
    Color all = math::white;
    for (const DiscCover& cover : covers) all = all * (cover.is_opaque ? math::black : cover.transmittance);
    if (has_triangles && !math::is_black(all) && !probe(0, 0)) all = math::black;
    halves.add(false, all), halves.add(true, all);
    return halves;
  }
  // In scene order, whatever structure found them: sums round the same way. Those of a cell come in order.
  if (!std::ranges::is_sorted(edges_, {}, &Edge::place)) std::ranges::sort(edges_, {}, &Edge::place);
  const Frame frame = choose_frame(covers, turn);
  place_chords(chords, shift);
  for (const Edge& edge : edges_) add(edge, frame);
  for (const DiscCover& cover : covers) {
    if (open_count_ == 0) break;
    add(cover, frame);
  }
  if (has_triangles) hide_behind_triangles();
  OpenPlace longest;
  for (std::size_t k = 0; k < count_; ++k) {
    if (chords_[k].half_length > 0) light(k, frame, longest);
  }
  const bool is_dark = longest.length == 0 || (has_triangles && !probe(longest.x, longest.y));
  for (std::size_t k = 0; k < count_; ++k) {
    if (chords_[k].half_length > 0) halves.add(k % 2 == 1, is_dark ? math::black : chords_[k].lit, chords_[k].weight);
  }
  return halves;
}

}  // namespace penumbra::shading::shadows
