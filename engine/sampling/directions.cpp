#include "engine/sampling/directions.h"

#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"

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

Vec3 point_in_cone(const SphereCone& cone, const Point2& square) {
  const Point2 disc = square_to_disc(square);
  // The equal-area map from the disc onto the cap: 1 − cos θ grows with the square of the radius.
  const double share = disc.x * disc.x + disc.y * disc.y;
  const double height = share * cone.one_minus_cosine;  // 1 − cos θ
  const double spread = std::sqrt(cone.one_minus_cosine * (2 - height));
  const double cosine = 1 - height, sine_squared = height * (2 - height);
  const double d = cone.distance, r = cone.radius;
  const double along = std::max(0.0, d * cosine - std::sqrt(std::max(0.0, r * r - d * d * sine_squared)));
  return (cone.frame.u * (disc.x * spread) + cone.frame.v * (disc.y * spread) + cone.frame.n * cosine) * along;
}

Vec3 direction_on_sphere(const Point2& square) {
  const double z = 1 - 2 * square.x, r = std::sqrt(std::max(0.0, 1 - z * z));
  const auto [sine, cosine] = math::sine_cosine_turns(square.y);
  return {r * cosine, r * sine, z};
}

std::optional<SphericalRectangle> SphericalRectangle::seen_from(const Vec3& from, const Vec3& corner,
                                                                const Vec3& edge_u, const Vec3& edge_v) {
  SphericalRectangle r;
  const double width = math::length(edge_u), height = math::length(edge_v);
  r.x_ = edge_u * (1 / width);
  r.y_ = edge_v * (1 / height);
  r.z_ = math::cross(r.x_, r.y_);
  const Vec3 d = corner - from;
  r.z0_ = math::dot(d, r.z_);
  if (r.z0_ > 0) r.z_ = -r.z_, r.z0_ = -r.z0_;
  r.x0_ = math::dot(d, r.x_), r.y0_ = math::dot(d, r.y_);
  r.x1_ = r.x0_ + width, r.y1_ = r.y0_ + height;
  // Too edge-on, or too small: the angles' sum then cancels to a few digits, and plain area sampling is as good.
  const double size = width + height,
               reach = std::max(std::fabs(r.x0_), std::fabs(r.x1_)) + std::max(std::fabs(r.y0_), std::fabs(r.y1_));
  if (!(-r.z0_ > 1e-4 * size) || !(size > 1e-2 * (reach - r.z0_))) return std::nullopt;
  // z components of the unit normals of the planes through the edges y0, x1, y1, x0; their other components do not meet
  // in the products of neighbours.
  const auto lean = [&](double a) { return a / std::sqrt(r.z0_ * r.z0_ + a * a); };
  const double n0 = -lean(r.y0_), n1 = lean(r.x1_), n2 = lean(r.y1_), n3 = -lean(r.x0_);
  const auto arc_cosine = [](double c) {
    const double bounded = std::clamp(c, -1.0, 1.0);
    return math::arc_tangent(std::sqrt((1 - bounded) * (1 + bounded)), bounded);
  };
  const double g0 = arc_cosine(-n0 * n1), g1 = arc_cosine(-n1 * n2), g2 = arc_cosine(-n2 * n3),
               g3 = arc_cosine(-n3 * n0);
  r.b0_ = n0, r.b1_ = n2;
  r.k_ = 2 * pi - g2 - g3;
  r.solid_angle_ = g0 + g1 - r.k_;
  if (!(r.solid_angle_ > 1e-6)) return std::nullopt;
  return r;
}

Vec3 SphericalRectangle::point(const Point2& square) const {
  const double turns = (square.x * solid_angle_ + k_) / (2 * pi);
  const auto [sine, cosine] = math::sine_cosine_turns(turns);
  const double fu = sine != 0 ? (cosine * b0_ - b1_) / sine : 0;
  const double cu = std::clamp(std::copysign(1 / std::sqrt(fu * fu + b0_ * b0_), fu), -1.0, 1.0);
  const double xu = std::clamp(-(cu * z0_) / std::sqrt(std::max(1e-300, 1 - cu * cu)), x0_, x1_);
  const double d = std::sqrt(xu * xu + z0_ * z0_);
  const double h0 = y0_ / std::sqrt(d * d + y0_ * y0_), h1 = y1_ / std::sqrt(d * d + y1_ * y1_);
  const double hv = h0 + square.y * (h1 - h0), hv2 = hv * hv;
  const double yv = hv2 < 1 ? std::clamp(hv * d / std::sqrt(1 - hv2), y0_, y1_) : y1_;
  return x_ * xu + y_ * yv + z_ * z0_;
}

}  // namespace penumbra::sampling
