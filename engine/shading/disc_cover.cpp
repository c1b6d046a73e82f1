#include "engine/shading/disc_cover.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/math/elementary.h"
#include "engine/math/vec3.h"

namespace penumbra::shading {
namespace {

using math::dot;

Linear linear(const Vec3& n, double constant, const DiscView& view, double sign) {
  return {sign * (dot(n, view.axis) - constant), sign * dot(n, view.u), sign * dot(n, view.v)};
}

struct Interval {
  double begin, end;
  const DiscCover* cover;
};

/// The chords' frame: a chord's points are offset·across + τ·along.
struct ChordFrame {
  sampling::Point2 across, along;
  Linear turned(const Linear& f) const { return {f.a, f.b * across.x + f.c * across.y, f.b * along.x + f.c * along.y}; }
};

/// Chords cross an edge at right angles best. The direction that most edges in sight agree on is the main axis of the
/// sum of their normals' tensors.
ChordFrame frame_for(std::span<const DiscCover> covers, double turn) {
  double xx = 0, xy = 0, yy = 0;
  for (const DiscCover& cover : covers) {
    for (const Linear& f : cover.edges) {
      const double squared = f.b * f.b + f.c * f.c;
      if (!(f.a * f.a < squared)) continue;
      const double weight = (1 - f.a * f.a / squared) / squared;
      xx += weight * f.b * f.b, xy += weight * f.b * f.c, yy += weight * f.c * f.c;
    }
  }
  const double difference = xx - yy, size = std::sqrt(difference * difference + 4 * xy * xy);
  if (!(size > 0.05 * (xx + yy))) {
    const auto [sine, cosine] = math::sine_cosine_turns(turn);
    return {{-sine, cosine}, {cosine, sine}};
  }
  // Half of the double angle (difference, 2xy).
  const double c = std::sqrt(std::max(0.0, 0.5 * (1 + difference / size)));
  const double s = std::copysign(std::sqrt(std::max(0.0, 0.5 * (1 - difference / size))), xy);
  return {{-s, c}, {c, s}};
}

/// The part of the chord at `offset` a cover hides.
class ChordCover {
 public:
  ChordCover(const DiscCover& cover, const ChordFrame& frame, const DiscView& view) : cover_(&cover) {
    for (const Linear& f : cover.edges) edges_[edge_count_++] = frame.turned(f);
    if (!cover.is_round) return;
    across_ = view.u * frame.across.x + view.v * frame.across.y;
    along_ = view.u * frame.along.x + view.v * frame.along.y;
    axis_ = view.axis;
  }

  Interval on(double offset, double half_length) const {
    double begin = -half_length, end = half_length;
    for (std::size_t i = 0; i < edge_count_; ++i) {
      const double value = edges_[i].a + edges_[i].b * offset, slope = edges_[i].c;
      if (slope > 0) {
        begin = std::max(begin, -value / slope);
      } else if (slope < 0) {
        end = std::min(end, -value / slope);
      } else if (value < 0) {
        end = begin;
      }
    }
    if (cover_->is_round && begin < end) clip_to_cone(offset, begin, end);
    return {begin, end, cover_};
  }

 private:
  /// edges[0] is the distance along the cone's axis, positive in [begin, end]; its square minus keen·|sample|² ≥ 0
  /// there.
  void clip_to_cone(double offset, double& begin, double& end) const {
    const Vec3 start = axis_ + across_ * offset;
    const double value = edges_[0].a + edges_[0].b * offset, slope = edges_[0].c, keen = cover_->keen;
    const double a = slope * slope - keen * dot(along_, along_);
    const double b = value * slope - keen * dot(start, along_);
    const double c = value * value - keen * dot(start, start);
    const auto is_inside = [&](double t) { return (a * t + 2 * b) * t + c >= 0; };
    const double discriminant = b * b - a * c;
    if (!(discriminant > 0) || a == 0) {
      if (!is_inside(0.5 * (begin + end))) end = begin;
      return;
    }
    const double q = -(b + std::copysign(std::sqrt(discriminant), b));
    double low = q / a, high = q != 0 ? c / q : -low;
    if (low > high) std::swap(low, high);
    if (a < 0) {
      begin = std::max(begin, low), end = std::min(end, high);
      return;
    }
    // A hyperbola: one branch is inside the cone, the other inside its mirror image, which edges[0] ≥ 0 has cut off.
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

  const DiscCover* cover_;
  std::array<Linear, 4> edges_;
  std::size_t edge_count_ = 0;
  Vec3 across_, along_, axis_;
};

/// ∫ of the transmittance along a chord. `opaque` is sorted by begin.
Color integral(std::span<const Interval> opaque, std::span<const Interval> clear, double half_length) {
  Color sum;
  const auto add_open = [&](double begin, double end) {
    if (clear.empty()) {
      sum += math::grey(end - begin);
      return;
    }
    // Between two neighbouring ends of intervals the product of transmittances is constant.
    for (double at = begin; at < end;) {
      double next = end;
      Color product = math::white;
      for (const Interval& interval : clear) {
        if (interval.begin > at) next = std::min(next, interval.begin);
        if (interval.begin <= at && at < interval.end) {
          next = std::min(next, interval.end);
          product = product * interval.cover->transmittance;
        }
      }
      sum += product * (next - at);
      at = next;
    }
  };
  double open_from = -half_length;
  for (const Interval& interval : opaque) {
    if (interval.begin > open_from) add_open(open_from, interval.begin);
    open_from = std::max(open_from, interval.end);
  }
  if (open_from < half_length) add_open(open_from, half_length);
  return sum;
}

}  // namespace

std::optional<DiscCover> cover_of(const geometry::TriangleVertices& triangle, const DiscView& view) {
  const Vec3 a = triangle.v0 - view.from, b = triangle.v1 - view.from, c = triangle.v2 - view.from;
  const Vec3 normal = math::cross(b - a, c - a);
  const double height = dot(normal, a);
  if (height == 0) return std::nullopt;
  // Seen from behind (height > 0: the normal points away from the viewer) the edges turn the other way round.
  const double sign = height > 0 ? 1 : -1;
  DiscCover cover;
  cover.edges = {linear(math::cross(a, b), 0, view, sign), linear(math::cross(b, c), 0, view, sign),
                 linear(math::cross(c, a), 0, view, sign), linear(normal, view.is_infinite ? 0 : height, view, sign)};
  return cover;
}

std::optional<DiscCover> cover_of(const geometry::SphereShape& sphere, const DiscView& view) {
  const Vec3 centre = sphere.center - view.from;
  const double distance = math::length(centre);
  if (!(distance > sphere.radius * (1 + math::gamma(64)))) return std::nullopt;
  if (!view.is_infinite) {
    const double depth = math::length(view.axis);
    if (!(dot(centre, view.axis) + sphere.radius * depth < depth * depth)) return std::nullopt;
  }
  DiscCover cover;
  cover.is_round = true;
  cover.keen = (distance - sphere.radius) * (distance + sphere.radius);
  cover.edges.fill({1, 0, 0});
  cover.edges[0] = linear(centre, 0, view, 1);
  return cover;
}

DiscCover cover_of(const geometry::PlaneShape& plane, const DiscView& view) {
  const double height = dot(plane.normal, plane.point - view.from);
  DiscCover cover;
  cover.edges.fill({1, 0, 0});
  cover.edges[0] = linear(plane.normal, view.is_infinite ? 0 : height, view, height > 0 ? 1 : -1);
  return cover;
}

DiscCover cover_below_horizon(const Vec3& facing, const DiscView& view) {
  DiscCover cover;
  cover.edges.fill({1, 0, 0});
  cover.edges[0] = linear(facing, 0, view, -1);
  return cover;
}

sampling::Halves mean_transmittance(std::span<const DiscCover> covers, const DiscView& view,
                                    const sampling::DiscChords& chords, double turn, double shift) {
  constexpr std::size_t capacity = 64;
  const ChordFrame frame = frame_for(covers, turn);
  std::vector<ChordCover> on_chords;
  on_chords.reserve(covers.size());
  for (const DiscCover& cover : covers) on_chords.emplace_back(cover, frame, view);
  const sampling::DiscChords::Shift shifted = chords.shifted(shift);
  sampling::Halves lit;
  for (int k = 0; k < chords.count(); ++k) {
    const sampling::DiscChords::Chord chord = chords.chord(k, shifted);
    if (!(chord.half_length > 0)) continue;
    std::array<Interval, capacity> opaque, clear;
    std::size_t opaque_count = 0, clear_count = 0;
    for (std::size_t i = 0; i < covers.size(); ++i) {
      const Interval hidden = on_chords[i].on(chord.offset, chord.half_length);
      if (!(hidden.begin < hidden.end)) continue;
      if (!covers[i].is_opaque) {
        clear[clear_count++] = hidden;
        continue;
      }
      std::size_t place = opaque_count++;
      for (; place > 0 && opaque[place - 1].begin > hidden.begin; --place) opaque[place] = opaque[place - 1];
      opaque[place] = hidden;
    }
    const Color open = integral({opaque.data(), opaque_count}, {clear.data(), clear_count}, chord.half_length);
    lit.add(k % 2 == 1, open * (1 / (2 * chord.half_length)), chord.weight);
  }
  return lit;
}

}  // namespace penumbra::shading
