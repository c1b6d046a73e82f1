#include <algorithm>
#include <array>
#include <cmath>

#include "engine/math/elementary.h"
#include "engine/shading/lights/area_light.h"
#include "engine/shading/phong.h"

namespace penumbra::shading {
namespace {

using math::dot;

/// ∫ |n·q| / |q|⁴ dσ over a part of the line q = nearest + σ·unit, with `nearest` across `unit`.
class DiffuseAlong {
 public:
  DiffuseAlong(const Vec3& n, const Vec3& nearest, const Vec3& unit)
      : at_nearest_(dot(n, nearest)), along_(dot(n, unit)), squared_(dot(nearest, nearest)) {}
  double operator()(double from, double to) const {
    const double turn = -at_nearest_ / along_;  // where the line meets the plane across n
    if (turn > from && turn < to) return on_one_side(from, turn) + on_one_side(turn, to);
    return on_one_side(from, to);
  }

 private:
  double on_one_side(double from, double to) const {
    const double distance = std::sqrt(squared_);
    if (to - from < 0.1 * distance) return by_nodes(from, to);
    const double f = squared_ + from * from, t = squared_ + to * to;
    const double angle = math::arc_tangent(distance * (to - from), squared_ + from * to);
    const double of_nearest = (to / t - from / f + angle / distance) / squared_;
    return 0.5 * std::fabs(at_nearest_ * of_nearest + along_ * (1 / f - 1 / t));
  }
  /// Gauss and Legendre's rule of three nodes: where differences of the closed form would cancel it is exact to 1e-9.
  double by_nodes(double from, double to) const {
    const double middle = 0.5 * (from + to), half = 0.5 * (to - from);
    const auto value = [&](double place) {
      const double f = squared_ + place * place;
      return (at_nearest_ + along_ * place) / (f * f);
    };
    constexpr double node = 0.77459666924148337704;
    return std::fabs(half / 9 * (5 * (value(middle - half * node) + value(middle + half * node)) + 8 * value(middle)));
  }
  double at_nearest_, along_, squared_;
};

/// A line across a light as its integrals need it.
class LitLine {
 public:
  LitLine(const ShadingPoint& at, const shadows::LightLine& line)
      : at_(at),
        line_(line),
        length_(math::length(line.along)),
        unit_(line.along * (1 / length_)),
        start_(dot(line.from, unit_)),
        diffuse_(at.surface.shading_normal, line.from - unit_ * start_, unit_) {}

  /// ∫ |n·q| / |q|⁴ over the strip between two shares of the line, above the horizon.
  double diffuse(double begin, double end) const {
    const double from = dot(at_.facing, line_.from), slope = dot(at_.facing, line_.along), horizon = -from / slope;
    if (slope > 0) begin = std::max(begin, horizon);
    if (slope < 0) end = std::min(end, horizon);
    if (!(begin < end) || (slope == 0 && !(from > 0))) return 0;
    return line_.width * diffuse_(start_ + begin * length_, start_ + end * length_);
  }
  /// A point of the line and the solid angle that it stands for, for each unit of the light's plane's distance, if it
  /// stands for a `share` of the line.
  struct Node {
    Color highlight;
    double weight;
  };
  Node node(double place, double share) const {
    const Vec3 towards = line_.from + line_.along * place;
    const double squared = dot(towards, towards), distance = std::sqrt(squared);
    const double weight = line_.width * length_ * share / (squared * distance);
    if (!is_on_viewers_side(at_, towards)) return {math::black, weight};
    return {highlight(at_, towards * (-1 / distance)) * weight, weight};
  }

 private:
  const ShadingPoint& at_;
  const shadows::LightLine& line_;
  double length_;
  Vec3 unit_;
  double start_;
  DiffuseAlong diffuse_;
};

/// Sums over some of the lines.
struct Half {
  Color seen, highlight, highlight_open;
  double open = 0, nodes = 0;
  Half operator+(const Half& o) const {
    return {seen + o.seen, highlight + o.highlight, highlight_open + o.highlight_open, open + o.open, nodes + o.nodes};
  }
};

Color over(const Color& seen, double open) { return open > 0 ? seen * (1 / open) : math::black; }

/// Adds up the open parts of the lines last traced.
Color sum_of_lines(const Lighting& lighting, const shadows::Sight& sight, const shadows::SeenArea& area,
                   const Unhidden& unhidden, const sampling::Key& key) {
  const ShadingPoint& at = lighting.at;
  const auto samples = static_cast<std::size_t>(lighting.sampling.spiral.count());
  const std::size_t lines = sight.line_count();
  const std::size_t nodes = math::is_black(at.material->specular) ? 0 : (samples + lines - 1) / lines;
  const double spacing = 1 / std::max(1.0, static_cast<double>(nodes));
  std::array<Half, 2> halves;
  const auto parts = sight.open_parts();
  std::size_t part = 0;
  for (std::size_t i = 0; i < lines; ++i) {
    const shadows::LightLine across = sight.line(area, i);
    const LitLine line(at, across);
    Half& half = halves[across.is_second ? 1 : 0];
    half.open += line.diffuse(0, 1);
    const std::size_t first = part;
    for (; part < parts.size() && parts[part].line == i; ++part)
      half.seen += parts[part].transmittance * line.diffuse(parts[part].begin, parts[part].end);
    constexpr double golden = 0.61803398874989484820;
    const double shift = std::fmod(key.uniform(1) + golden * static_cast<double>(i), 1.0);
    for (std::size_t k = 0, at_part = first; k < nodes; ++k) {
      const double place = (static_cast<double>(k) + shift) * spacing;
      const auto [found, weight] = line.node(place, spacing);
      half.highlight_open += found, half.nodes += weight;
      while (at_part < part && parts[at_part].end <= place) ++at_part;
      if (at_part < part && parts[at_part].begin <= place) half.highlight += found * parts[at_part].transmittance;
    }
  }
  const Color shine = unhidden.radiance * (unhidden.solid_angle / math::pi);
  const auto light = [&](const Half& of) {
    return filtered(unhidden.diffuse, over(of.seen, of.open)) + filtered(shine, over(of.highlight, of.nodes));
  };
  const Half both = halves[0] + halves[1];
  const Color sum = light(both), apart = light(halves[0]) - light(halves[1]);
  const int count = static_cast<int>(lines);
  const auto order = area.is_round ? sampling::Halves::chords(count) : sampling::Halves::lines(count);
  // That the lines agree does not mean that all would, as for discs.
  const double n = static_cast<double>(lines), share = 0.5 / (n + 1);
  const Color most = unhidden.diffuse + filtered(shine, over(both.highlight_open, both.nodes));
  const Color squared = filtered(lighting.weight, lighting.weight);
  const auto modelled = [&](double seen, double all) {
    const double s = all > 0 ? std::clamp(seen / all, share, 1 - share) : 0;
    return chord_variance * s * (1 - s) * all * all / (n * n * n);
  };
  lighting.variance.measured += filtered(squared, apart * apart * (0.25 * order.of_half_difference));
  lighting.variance.modelled +=
      filtered(squared, {modelled(sum.r, most.r), modelled(sum.g, most.g), modelled(sum.b, most.b)});
  lighting.skip_samples(&Counters::shadow_rays_covered);
  return sum;
}

}  // namespace

std::optional<Color> traced(const Lighting& lighting, shadows::Sight& sight, const shadows::SeenArea& area,
                            const Unhidden& unhidden, const sampling::Key& key) {
  using Verdict = shadows::Sight::Verdict;
  const Verdict verdict = sight.trace(area, lighting.sampling, key);
  if (verdict == Verdict::unknown) return std::nullopt;
  if (verdict == Verdict::dark) return lighting.skip_samples(&Counters::shadow_rays_dark), math::black;
  if (verdict == Verdict::lit) {
    if (math::is_black(lighting.at.material->specular))
      return lighting.skip_samples(&Counters::area_samples_exact), unhidden.diffuse;
    sight.trace_open(area, lighting.sampling, key);
  }
  return sum_of_lines(lighting, sight, area, unhidden, key);
}

}  // namespace penumbra::shading
