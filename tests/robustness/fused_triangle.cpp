// tests/CMakeLists.txt compiles this file with contraction; the engine's source comes in under another name.
#define penumbra penumbra_fused
#include "engine/geometry/triangle.cpp"
#undef penumbra

#include "tests/robustness/fused_triangle.h"

namespace fused {

bool meets(const std::array<Point, 3>& triangle, const Point& origin, const Point& direction) {
  using penumbra_fused::math::Vec3;
  const auto of = [](const Point& p) { return Vec3{p[0], p[1], p[2]}; };
  const penumbra_fused::geometry::PreparedRay ray(of(origin), of(direction));
  return intersect({of(triangle[0]), of(triangle[1]), of(triangle[2])}, ray, HUGE_VAL).has_value();
}

bool is_available() { return __builtin_cpu_supports("fma") != 0; }

}  // namespace fused
