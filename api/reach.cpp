#include "api/reach.h"

#include <algorithm>

#include "api/values.h"
#include "engine/math/bounds.h"

namespace penumbra::api {

namespace {

using math::Vec3;

Vec3 all(double x) { return {x, x, x}; }

Reach of(const scene::Sphere& s) { return {math::abs(s.center) + all(s.radius), s.radius}; }
Reach of(const scene::Plane& p) { return {math::abs(p.point), 0}; }
Reach of(const scene::Tube& t) { return {math::abs(t.point) + all(t.radius), t.radius}; }
Reach of(const scene::Cylinder& c) {
  return {math::abs(c.point) + all(c.radius + c.height), std::min(c.radius, c.height)};
}
Reach of(const scene::Triangle& t) { return reach_of(t.vertices); }
Reach of(const scene::Polygon& p) { return reach_of(p.vertices); }
Reach of(const scene::Mesh& m) { return reach_of(m.positions); }
Reach of(const scene::Instance&) { return {}; }
Reach of(const scene::Group&) { return {}; }

}  // namespace

bool Reach::is_within_limits() const {
  // A ball at the largest coordinates reaches a little further.
  return max_component(farthest) <= 4 * largest_length && (size == 0 || size >= smallest_length);
}

Reach reach_of(std::span<const Vec3> points) {
  if (points.empty()) return {};
  math::Bounds box;
  for (const Vec3& point : points) box.include(point);
  return {math::max(math::abs(box.lower), math::abs(box.upper)), max_component(box.extent())};
}

Reach reach_of(const scene::Shape& shape) {
  return std::visit([](const auto& s) { return of(s); }, shape);
}

Reach placed(const Reach& reach, const math::Affine& placement) {
  if (placement == math::Affine{}) return reach;
  const auto& [x, y, z] = placement.column;
  const Vec3 farthest = math::abs(x) * reach.farthest.x + math::abs(y) * reach.farthest.y +
                        math::abs(z) * reach.farthest.z + math::abs(placement.translation);
  return {farthest, reach.size * std::max({math::length(x), math::length(y), math::length(z)})};
}

}  // namespace penumbra::api
