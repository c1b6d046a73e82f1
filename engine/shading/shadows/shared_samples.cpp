#include "engine/shading/shadows/shared_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace penumbra::shading::shadows {
namespace {

using math::dot;

/// A point, where its pixel is, and what it sees.
struct Member {
  const ShadingPoint* at;
  double x, y;  // pixels
  Visibility* seen;
};

/// Whether the surface goes on from one point to the other, as far as their places tell.
bool is_one_surface(const Member& a, const Member& b) {
  const ShadingPoint &from = *a.at, &to = *b.at;
  if (!(dot(from.facing, to.facing) > 0.5)) return false;
  const Vec3 way = to.surface.position - from.surface.position;
  const double squared = dot(way, way), pixels = (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
  const double near = 2 * from.footprint;
  if (squared <= near * near * pixels) return true;
  const double most = 0.25 * std::sqrt(squared);
  return std::fabs(dot(from.facing, way)) <= most && std::fabs(dot(to.facing, way)) <= most;
}

/// The plane c + a·x + b·y through values at pixels, by least squares, or c alone where few pixels tell no slope.
class Plane {
 public:
  explicit Plane(std::span<const Member> members) : members_(members) {
    const double n = 1 / static_cast<double>(members.size());
    for (const Member& member : members) x_ += member.x * n, y_ += member.y * n;
    for (const Member& member : members) {
      const double x = member.x - x_, y = member.y - y_;
      xx_ += x * x, xy_ += x * y, yy_ += y * y;
    }
    const double determinant = xx_ * yy_ - xy_ * xy_;
    constexpr std::size_t least = 6;
    has_slope_ = members.size() >= least && determinant > 0.05 * xx_ * yy_;
    if (has_slope_) scale_ = 1 / determinant;
  }
  double unknowns() const { return has_slope_ ? 3 : 1; }
  void fit(double Color::*channel) {
    c_ = 0;
    for (const Member& member : members_) c_ += member.seen->mean.*channel;
    c_ /= static_cast<double>(members_.size());
    double vx = 0, vy = 0;
    for (const Member& member : members_) {
      const double v = member.seen->mean.*channel - c_;
      vx += v * (member.x - x_), vy += v * (member.y - y_);
    }
    a_ = (vx * yy_ - vy * xy_) * scale_, b_ = (vy * xx_ - vx * xy_) * scale_;
  }
  double at(const Member& member) const { return c_ + a_ * (member.x - x_) + b_ * (member.y - y_); }

 private:
  std::span<const Member> members_;
  double x_ = 0, y_ = 0, xx_ = 0, xy_ = 0, yy_ = 0, scale_ = 0;
  bool has_slope_ = false;
  double a_ = 0, b_ = 0, c_ = 0;
};

/// Each point's value goes towards the plane the further, the less the values vary around it beyond what their samples
/// explain (Fay, Herriot, "Estimates of Income for Small Places", 1979).
void share_channel(std::span<const Member> members, bool is_one_pattern, double Color::*channel, Plane& plane) {
  const auto n = static_cast<double>(members.size());
  double noise = 0, modelled = 0;
  for (const Member& member : members)
    noise += member.seen->variance.measured.*channel, modelled += member.seen->variance.modelled.*channel;
  noise /= n, modelled /= n;
  plane.fit(channel);
  double apart = 0;
  for (const Member& member : members) {
    const double residual = member.seen->mean.*channel - plane.at(member);
    apart += residual * residual;
  }
  constexpr double least = 1e-7;  // hardly worth it, and not worth a difference between much the same scenes
  const double misfit = std::max(0.0, apart / (n - plane.unknowns()) - noise) + least;
  const double own = misfit / (misfit + noise);
  // What is well spread together makes a plane that is off by less than one of values that know nothing of each other.
  // And what they vary by tells `misfit` only roughly.
  const double of_plane = plane.unknowns() / (is_one_pattern ? n * std::sqrt(std::sqrt(n)) : n), of_misfit = 1 / n;
  const double left = own + (1 - own) * (of_plane + of_misfit);
  for (const Member& member : members) {
    double& value = member.seen->mean.*channel;
    value = own * value + (1 - own) * std::clamp(plane.at(member), 0.0, 1.0);
    member.seen->variance.measured.*channel = noise * left;
    member.seen->variance.modelled.*channel = modelled * left;
  }
}

void share(std::span<const Member> members, bool is_one_pattern) {
  const auto is_grey = [](const Member& member) {
    const Color& mean = member.seen->mean;
    return mean.r == mean.g && mean.g == mean.b;
  };
  const bool is_all_grey = std::ranges::all_of(members, is_grey);
  Plane plane(members);
  share_channel(members, is_one_pattern, &Color::r, plane);
  if (!is_all_grey) {
    for (double Color::*channel : {&Color::g, &Color::b}) share_channel(members, is_one_pattern, channel, plane);
    return;
  }
  for (const Member& member : members) {
    Visibility& seen = *member.seen;
    seen.mean = math::grey(seen.mean.r);
    seen.variance = {math::grey(seen.variance.measured.r), math::grey(seen.variance.modelled.r)};
  }
}

}  // namespace

std::size_t share_samples(const PointBatch& points, LaneMask lanes, bool is_one_pattern, Visibility* seen) {
  constexpr std::size_t least = 4;
  const auto square_of = [](double place) { return static_cast<int>(place) / 4; };
  bool is_alike = true;
  for_each_lane(
      lanes, [&](std::size_t lane) { is_alike = is_alike && seen[lane].mean == seen[std::countr_zero(lanes)].mean; });
  if (is_alike) return 0;
  std::size_t shared = 0;
  std::array<Member, lane_count> surface;
  while (static_cast<std::size_t>(std::popcount(lanes)) >= least) {
    // From the first on, whatever goes on from a point that belongs to it, in one square of the picture.
    std::size_t size = 0;
    const PixelPlace& first = points.pixel(static_cast<std::size_t>(std::countr_zero(lanes)));
    for_each_lane(lanes, [&](std::size_t lane) {
      const PixelPlace& pixel = points.pixel(lane);
      if (square_of(pixel.x) != square_of(first.x) || square_of(pixel.y) != square_of(first.y)) return;
      const Member member{&points.point(lane), pixel.x, pixel.y, &seen[lane]};
      bool belongs = size == 0;
      for (std::size_t i = size; i-- > 0 && !belongs;) belongs = is_one_surface(surface[i], member);
      if (belongs) surface[size++] = member, lanes &= ~(LaneMask{1} << lane);
    });
    if (size < least) continue;
    share({surface.data(), size}, is_one_pattern);
    shared += size;
  }
  return shared;
}

}  // namespace penumbra::shading::shadows
