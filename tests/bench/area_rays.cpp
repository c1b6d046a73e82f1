#include "tests/bench/area_rays.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/math/constants.h"

namespace penumbra::bench {
namespace {

float narrow(double value) { return static_cast<float>(value); }
FloatVec narrow(const Vec3& v) { return {narrow(v.x), narrow(v.y), narrow(v.z)}; }

SeenRectangle seen(const scene::RectangleLight& light, const Vec3& corner) {
  const Vec3 ex = math::normalize(light.edge_u), ey = math::normalize(light.edge_v);
  Vec3 ez = math::cross(ex, ey);
  double z0 = math::dot(corner, ez);
  if (z0 > 0) ez = -ez, z0 = -z0;
  const double x0 = math::dot(corner, ex), x1 = x0 + math::length(light.edge_u);
  const double y0 = math::dot(corner, ey), y1 = y0 + math::length(light.edge_v);
  const std::array<Vec3, 4> v{Vec3{x0, y0, z0}, {x1, y0, z0}, {x1, y1, z0}, {x0, y1, z0}};
  std::array<Vec3, 4> n;
  for (std::size_t i = 0; i < 4; ++i) n[i] = math::normalize(math::cross(v[i], v[(i + 1) % 4]));
  const auto angle = [&](std::size_t i) { return std::acos(-math::dot(n[i], n[(i + 1) % 4])); };
  const double k = 2 * math::pi - angle(2) - angle(3);
  return {narrow(ex), narrow(ey), narrow(ez * z0), narrow(x0),     narrow(x1), narrow(y0),
          narrow(y1), narrow(z0), narrow(n[0].z),  narrow(n[2].z), narrow(k),  narrow(angle(0) + angle(1) - k)};
}

}  // namespace

AreaRays::AreaRays(const PointPatterns& discs, const PointPatterns& squares) : discs_(discs), squares_(squares) {
  for (std::vector<float>* each : {&x_, &y_, &z_, &cosine_}) each->resize(static_cast<std::size_t>(discs.samples()));
}

bool AreaRays::aim(const AreaLight& light, const Lit& lit, std::uint32_t set, Random& random) {
  if (!std::visit([&](const auto& l) { return start(l, lit, set, random); }, light)) return false;
  find_cosines(narrow(lit.facing), narrow(lit.shading_normal), lanes());
  return true;
}

bool AreaRays::start(const scene::RectangleLight& light, const Lit& lit, std::uint32_t set, Random& random) {
  const Vec3 corner = light.corner - lit.origin;
  if (math::dot(math::cross(light.edge_u, light.edge_v), corner) >= 0) return false;
  const std::array<Vec3, 4> corners{corner, corner + light.edge_u, corner + light.edge_u + light.edge_v,
                                    corner + light.edge_v};
  if (std::ranges::none_of(corners, [&](const Vec3& c) { return math::dot(c, lit.facing) > 0; })) return false;
  const SeenRectangle rectangle = seen(light, corner);
  solid_angle_ = static_cast<double>(rectangle.solid_angle);
  const float shift_u = random.uniform(), shift_v = random.uniform();
  aim_at(rectangle, squares_.x(set), squares_.y(set), shift_u, shift_v, lanes());
  return true;
}

bool AreaRays::start(const scene::SphereLight& light, const Lit& lit, std::uint32_t set, Random& random) {
  const Vec3 axis = light.center - lit.origin;
  const double distance = math::length(axis), sine = light.radius / distance;
  if (math::dot(axis, lit.facing) <= -light.radius || sine >= 1) return false;
  const double one_minus_cosine = sine * sine / (1 + std::sqrt(1 - sine * sine));
  solid_angle_ = 2 * math::pi * one_minus_cosine;
  const math::Frame frame = math::frame_around(axis * (1 / distance));
  const double angle = 2 * math::pi * static_cast<double>(random.uniform()), c = std::cos(angle), s = std::sin(angle);
  aim_at(SeenSphere{narrow(frame.n), narrow(frame.u * c + frame.v * s), narrow(frame.v * c - frame.u * s),
                    narrow(distance), narrow(light.radius), narrow(one_minus_cosine)},
         discs_.x(set), discs_.y(set), lanes());
  return true;
}

}  // namespace penumbra::bench
