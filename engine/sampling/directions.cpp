#include "engine/sampling/directions.h"

#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"
#include "engine/math/error_free.h"

namespace penumbra::sampling {

using math::pi;

std::optional<SphereCone> cone_of_sphere(const Vec3& from, const Vec3& center, double radius) {
  const Vec3 axis = center - from;
  const double distance = math::length(axis);
  if (!(distance > radius)) return std::nullopt;
  const double sine = radius / distance;
  const double cosine = std::sqrt((1 - sine) * (1 + sine));
  const double one_minus_cosine = sine * sine / (1 + cosine);
  return SphereCone{math::frame_around(axis * (1 / distance)), distance, radius, one_minus_cosine,
                    2 * pi * one_minus_cosine};
}

SeenPlace point_in_cone(const SphereCone& cone, const Point2& square) {
  const Point2 disc = square_to_disc(square);
  // The equal-area map from the disc onto the cap: 1 − cos θ grows with the square of the radius.
  const double share = disc.x * disc.x + disc.y * disc.y;
  const double height = share * cone.one_minus_cosine;  // 1 − cos θ
  const double spread = std::sqrt(cone.one_minus_cosine * (2 - height));
  const double cosine = 1 - height, sine_squared = height * (2 - height);
  const double d = cone.distance, r = cone.radius;
  // Of the two distances the nearer one, as a quotient: from close by their difference would cancel to nothing.
  const double along = (d - r) * (d + r) / (d * cosine + std::sqrt(std::max(0.0, r * r - d * d * sine_squared)));
  return {cone.frame.u * (disc.x * spread) + cone.frame.v * (disc.y * spread) + cone.frame.n * cosine, along};
}

Vec3 direction_on_sphere(const Point2& square) {
  const double z = 1 - 2 * square.x, r = std::sqrt(std::max(0.0, 1 - z * z));
  const auto [sine, cosine] = math::sine_cosine_turns(square.y);
  return {r * cosine, r * sine, z};
}

SeenParallelogram::SeenParallelogram(const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v, const Vec3& normal)
    : down_(-normal), height_(math::dot(down_, corner)) {
  const bool is_u_longer = math::length(edge_u) > math::length(edge_v);
  const Vec3 &longer = is_u_longer ? edge_u : edge_v, &shorter = is_u_longer ? edge_v : edge_u;
  length_ = math::length(longer);
  along_ = longer * (1 / length_);
  Vec3 start = corner;
  // Lines further on start further up.
  if (math::dot(along_, shorter) < 0) start += longer, along_ = -along_;
  across_ = math::cross(along_, normal);
  if (math::dot(across_, shorter) < 0) across_ = -across_;
  step_ = {math::dot(across_, shorter), math::dot(along_, shorter)};
  first_ = {math::dot(across_, start), math::dot(along_, start)};
  // What of each line is nearest: its upper end, the foot of the perpendicular, its lower end.
  const auto line_with = [&](double y) { return y >= 0 ? 0 : -y >= step_.y ? 1 : -y / step_.y; };
  const double upper = line_with(first_.y + length_), lower = line_with(first_.y);
  pieces_[0] = piece({first_.x, first_.y + length_}, step_, 0, upper);
  pieces_[1] = piece({first_.x, 0}, {step_.x, 0}, upper, lower);
  pieces_[2] = piece(first_, step_, lower, 1);
  for (const Piece& p : pieces_) mass_ += p.mass;
}

SeenParallelogram::Piece SeenParallelogram::piece(const Point2& start, const Point2& step, double from,
                                                  double to) const {
  Piece p{from, to};
  if (!(from < to)) return p;
  const double x = start.x + from * step.x, y = start.y + from * step.y;
  p.squared = x * x + y * y + height_ * height_;
  p.dot = math::difference_of_products(x, step.x, -y, step.y);
  const double in_plane = math::difference_of_products(x, step.y, y, step.x);
  p.cross = std::sqrt(in_plane * in_plane + height_ * height_ * (step.x * step.x + step.y * step.y));
  p.angle = math::arc_tangent((to - from) * p.cross, p.squared + (to - from) * p.dot);
  p.mass = p.angle / p.cross;
  return p;
}

double SeenParallelogram::line_at(double share) const {
  double left = share * mass_;
  const Piece* p = &pieces_[0];
  while (p != &pieces_[2] && left >= p->mass) left -= p->mass, ++p;
  const auto [sine, cosine] = math::sine_cosine_turns(std::min(left * p->cross, p->angle) / (2 * pi));
  const double divisor = p->cross * cosine - p->dot * sine;
  return divisor > 0 ? std::min(p->to, p->from + p->squared * sine / divisor) : p->to;
}

SeenParallelogram::Sample SeenParallelogram::sample(const Point2& square) const {
  const double s = line_at(square.x);
  const double x = first_.x + s * step_.x, y0 = first_.y + s * step_.y, y1 = y0 + length_;
  const double d2 = x * x + height_ * height_, r0 = std::sqrt(d2 + y0 * y0), r1 = std::sqrt(d2 + y1 * y1);
  const double sine0 = y0 / r0, sine1 = y1 / r1;
  // Along a line the solid angle grows with the sine of the angle from the perpendicular.
  const double u = square.y, sine = sine0 + u * (sine1 - sine0);
  // As sums of what is not negative: 1 − sine², and the difference of the sines.
  const double beyond =
      (1 - u) * (d2 / (r0 * r0)) + u * (d2 / (r1 * r1)) + u * (1 - u) * (sine1 - sine0) * (sine1 - sine0);
  const double y = std::clamp(std::sqrt(d2 / beyond) * sine, y0, y1);
  const double near = y0 > 0 ? r0 : y1 < 0 ? r1 : 0;
  const double weight = near > 0 ? length_ * std::fabs(y0 + y1) * (near / r0) * (near / r1) /
                                       (r0 * r1 * (std::fabs(sine0) + std::fabs(sine1)))
                                 : sine1 - sine0;
  return {across_ * x + along_ * y + down_ * height_, height_ * step_.x * mass_ * weight};
}

}  // namespace penumbra::sampling
