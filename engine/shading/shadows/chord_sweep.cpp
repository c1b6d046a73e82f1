#include "engine/shading/shadows/chord_sweep.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/math/constants.h"
#include "engine/math/elementary.h"
#include "engine/shading/shadows/cover_chords.h"

namespace penumbra::shading::shadows {
namespace {

using sampling::Point2;

// Of a chord's half: shorter parts are the rounding of edges that meet, and tell nothing of what is in line there.
constexpr double shortest_part = 1e-9;
// Of the disc's radius: less of an edge in sight does not turn the chords.
constexpr double noticeable = 1e-4;

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

Point2 ChordSweep::Frame::at(double offset, double place) const {
  return {offset * across.x + place * along.x, offset * across.y + place * along.y};
}

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

void ChordSweep::set_count(std::size_t count) {
  count_ = count;
  if (chords_.size() < count_) chords_.resize(count_);
  open_count_ = 0;
  const std::size_t padded = (count_ + 3) / 4 * 4;
  if (offset_.size() == padded) return;
  for (std::vector<double>* lanes : {&offset_, &open_begin_, &open_end_, &cover_begin_, &cover_end_})
    lanes->assign(padded, 0);
  cover_hits_.assign((padded + 7) / 8, 0);
}

void ChordSweep::place(std::size_t index, const Place& at) {
  Chord& chord = chords_[index];
  chord.half_length = at.half_length, chord.weight = at.weight, chord.depth = 0;
  chord.begin = at.begin, chord.end = at.end;
  open_count_ += at.begin < at.end ? 1 : 0;
  offset_[index] = at.offset, open_begin_[index] = at.begin, open_end_[index] = at.end;
  chord.crossings.clear(), chord.opaque.clear(), chord.clear.clear();
}

void ChordSweep::place_chords(const sampling::DiscChords& chords, double shift) {
  set_count(static_cast<std::size_t>(chords.count()));
  const sampling::DiscChords::Shift shifted = chords.shifted(shift);
  for (std::size_t k = 0; k < count_; ++k) {
    const auto [offset, half_length, weight] = chords.chord(chords.count() - 1 - static_cast<int>(k), shifted);
    place(k, {offset, half_length, weight, -half_length, half_length});
  }
}

void ChordSweep::place_lines(const sampling::DiscChords& chords, const Frame& frame, double shift) {
  set_count(static_cast<std::size_t>(chords.count()));
  const double reach = half_square * (std::fabs(frame.across.x) + std::fabs(frame.across.y));
  const double width = 2 * reach / static_cast<double>(count_);
  for (std::size_t k = 0; k < count_; ++k) {
    const double offset = (static_cast<double>(k) + shift) * width - reach;
    const auto [begin, end] = frame.across_square(offset);
    place(k, {offset, 1, width, begin, std::max(begin, end)});
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

/// Whether a chord begins at this point of the rim, rather than ends there.
bool ChordSweep::begins_at(const Point2& rim, const Frame& frame) const {
  if (region_ == Region::disc) return rim.x < 0;
  const Span chord = frame.across_square(rim.y);
  return rim.x < 0.5 * (chord.begin + chord.end);
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
  // Where an edge pierces the rim on the left, chords above begin on its other side.
  if (enters && begins_at(a, frame)) {
    for (std::size_t k = begin; k < count_; ++k) chords_[k].depth -= jump;
  }
  if (leaves && begins_at(b, frame)) {
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
    double from = chord.begin;
    const double shortest = shortest_part * chord.half_length;
    for (Crossing& crossing : chord.crossings) {
      crossing.at = std::clamp(crossing.at, chord.begin, chord.end);
      if (crossing.at - from > shortest) least = std::min(least, depth);
      depth += crossing.jump, from = crossing.at;
    }
    if (chord.end - from > shortest) least = std::min(least, depth);
  }
  for (std::size_t k = 0; k < count_; ++k) {
    Chord& chord = chords_[k];
    int depth = chord.depth;
    double from = chord.begin;
    const auto hide_until = [&](double end) {
      if (depth > least && end > from) hide(k, {from, end, nullptr});
      from = end;
    };
    for (const Crossing& crossing : chord.crossings) {
      hide_until(crossing.at);
      depth += crossing.jump;
    }
    hide_until(chord.end);
  }
}

template <class Use>
void ChordSweep::for_each_open(std::size_t index, const Use& use) const {
  double open_from = open_begin_[index];
  for (const Interval& interval : chords_[index].opaque) {
    const double open_until = std::min(interval.begin, open_end_[index]);
    if (open_until > open_from) use(open_from, open_until);
    open_from = std::max(open_from, interval.end);
  }
  if (open_from < open_end_[index]) use(open_from, open_end_[index]);
}

template <class Use>
void ChordSweep::for_each_tinted(std::size_t index, const Use& use) const {
  const std::vector<Interval>& clear = chords_[index].clear;
  for_each_open(index, [&](double begin, double end) {
    if (clear.empty()) return use(begin, end, math::white);
    // Between two neighbouring ends of intervals the product of transmittances is constant.
    for (double place = begin; place < end;) {
      double next = end;
      Color product = math::white;
      for (const Interval& interval : clear) {
        if (interval.begin > place) next = std::min(next, interval.begin);
        if (interval.begin <= place && place < interval.end) {
          next = std::min(next, interval.end);
          product = product * interval.cover->transmittance;
        }
      }
      use(place, next, product);
      place = next;
    }
  });
}

bool ChordSweep::hide_all(std::span<const DiscCover> covers, bool has_triangles, const Frame& frame,
                          const Probe& probe) {
  for (const Edge& edge : edges_) add(edge, frame);
  for (const DiscCover& cover : covers) {
    if (open_count_ == 0) break;
    add(cover, frame);
  }
  if (has_triangles) hide_behind_triangles();
  double longest = 0, offset = 0, middle = 0;
  for (std::size_t k = 0; k < count_; ++k) {
    std::sort(chords_[k].opaque.begin(), chords_[k].opaque.end(),
              [](const Interval& a, const Interval& b) { return a.begin < b.begin; });
    for_each_open(k, [&](double begin, double end) {
      if (end - begin > longest) longest = end - begin, offset = offset_[k], middle = 0.5 * (begin + end);
    });
  }
  const Point2 place = frame.at(offset, middle);
  return longest > 0 && (!has_triangles || probe(place.x, place.y));
}

sampling::Halves ChordSweep::integrate(std::span<const DiscCover> covers, std::span<const SilhouetteEdge> silhouette,
                                       bool has_triangles, const sampling::DiscChords& chords, double turn,
                                       double shift, const Probe& probe) {
  sampling::Halves halves;
  if (find_edges(Region::disc, covers, silhouette)) {
    const Color all = behind_all(covers, has_triangles, probe);
    halves.add(false, all), halves.add(true, all);
    return halves;
  }
  const Frame frame = choose_frame(covers, turn);
  place_chords(chords, shift);
  const bool is_dark = !hide_all(covers, has_triangles, frame, probe);
  for (std::size_t k = 0; k < count_; ++k) {
    if (!(chords_[k].half_length > 0)) continue;
    Color sum;
    if (!is_dark) {
      for_each_tinted(k, [&](double begin, double end, const Color& product) { sum += product * (end - begin); });
      sum = sum * (1 / (2 * chords_[k].half_length));
    }
    halves.add(k % 2 == 1, sum, chords_[k].weight);
  }
  return halves;
}

Color ChordSweep::behind_all(std::span<const DiscCover> covers, bool has_triangles, const Probe& probe) const {
  Color all = math::white;
  for (const DiscCover& cover : covers) all = all * (cover.is_opaque ? math::black : cover.transmittance);
  return has_triangles && !math::is_black(all) && !probe(0, 0) ? math::black : all;
}

void ChordSweep::trace(Region region, std::span<const DiscCover> covers, std::span<const SilhouetteEdge> silhouette,
                       bool has_triangles, const sampling::DiscChords& chords, double turn, double shift,
                       const Probe& probe) {
  lines_.clear(), open_parts_.clear();
  const Color all = find_edges(region, covers, silhouette) ? behind_all(covers, has_triangles, probe) : math::black;
  const Frame frame = choose_frame(covers, turn);
  region == Region::disc ? place_chords(chords, shift) : place_lines(chords, frame, shift);
  const bool is_dark = is_certain_ || !hide_all(covers, has_triangles, frame, probe);
  for (std::size_t k = 0; k < count_; ++k) {
    const Chord& chord = chords_[k];
    const double length = chord.end - chord.begin;
    if (!(length > 0)) continue;
    // A chord's weight is its share of the disc, π in all.
    lines_.push_back({frame.at(offset_[k], chord.begin), frame.at(offset_[k], chord.end),
                      region == Region::disc ? chord.weight * math::pi / length : chord.weight, k % 2 == 1});
    if (is_certain_ && !math::is_black(all)) open_parts_.push_back({lines_.size() - 1, 0, 1, all});
    if (is_dark) continue;
    for_each_tinted(k, [&](double begin, double end, const Color& product) {
      if (!math::is_black(product))
        open_parts_.push_back(
            {lines_.size() - 1, (begin - chord.begin) / length, (end - chord.begin) / length, product});
    });
  }
}

}  // namespace penumbra::shading::shadows
