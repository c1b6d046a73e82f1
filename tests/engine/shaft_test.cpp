// Shafts from a point to a quadrilateral: what a segment crosses is not missed, and what hides all is found.
#include "engine/shading/shadows/shaft.h"

#include <doctest/doctest.h>

#include <algorithm>

#include "engine/shading/shadows/candidates.h"
#include "tests/robustness/worlds.h"

using namespace penumbra;
using math::Vec3;
using shading::shadows::Candidates;
using shading::shadows::Shaft;

namespace {

struct Square {
  Vec3 apex, way, u, v;
  bool is_infinite;
  Square(test::Random& random, bool is_far) : apex(random.in_cube(3)), is_infinite(is_far) {
    const math::Frame frame = math::frame_around(random.direction());
    const double size = random.between(0.01, 0.5);
    way = frame.n * (is_infinite ? 1 : random.between(1, 6)), u = frame.u * size, v = frame.v * size;
  }
  Shaft shaft() const {
    std::array<Vec3, 4> corners{way - u - v, way + u - v, way + u + v, way - u + v};
    if (!is_infinite) {
      for (Vec3& corner : corners) corner += apex;
    }
    return {{apex, 0}, corners, is_infinite};
  }
  Vec3 direction(test::Random& random) const { return way + u * random.between(-1, 1) + v * random.between(-1, 1); }
  Vec3 point(test::Random& random) const {
    return apex + direction(random) * random.between(0.01, is_infinite ? 10 : 0.99);
  }
};

}  // namespace

TEST_CASE("a tube or plane that some segment of a shaft touches is not missed, and most that none does are") {
  test::Random random(61);
  int missed_tubes = 0, missed_planes = 0, apart = 0;
  for (int i = 0; i < 10'000; ++i) {
    const Square square(random, i % 2 == 0);
    const Shaft shaft = square.shaft();
    const Vec3 axis = random.direction(), out = math::normalize(math::cross(axis, random.direction()));
    const double radius = random.between(0.01, 1);
    const Vec3 at = square.point(random);
    CHECK_FALSE(shaft.misses(geometry::TubeShape{at + out * radius + axis * random.between(-3, 3), axis, radius}));
    CHECK_FALSE(shaft.misses(geometry::PlaneShape{at + out * random.between(-3, 3), axis}));
    // On the far side of the apex, across the way.
    const Vec3 side = math::normalize(square.u);
    const geometry::TubeShape beside{square.apex + side * 9 - square.way * 9, math::normalize(square.v), radius};
    missed_tubes += shaft.misses(beside) ? 1 : 0;
    missed_planes += shaft.misses(geometry::PlaneShape{square.apex - square.way, square.way}) ? 1 : 0;
    apart += square.is_infinite ? 0 : 1;
  }
  CHECK(missed_tubes >= apart);
  CHECK(missed_planes == 10'000);
}

TEST_CASE("one ball between a point and a square hides all of it, and is found to") {
  test::Random random(62);
  for (int i = 0; i < 300; ++i) {
    const Square square(random, false);
    accel::World world;
    const double size = 1.5 * math::length(square.u) + 0.01;
    const double away = math::length(square.way);
    // Between both, and not around either.
    const double radius = 0.75 * size + 0.05;
    if (radius > 0.4 * away) continue;
    scene::Object ball{scene::Sphere{square.apex + square.way * 0.5, radius}, {}};
    const shading::Scene scene = test::compiled(test::with_objects({ball}));
    Candidates candidates;
    candidates.gather(scene.world, square.shaft(), {}, false);
    CHECK(candidates.is_dark());
    std::get<scene::Sphere>(ball.shape).center += math::normalize(square.u) * (0.9 * radius);
    const shading::Scene beside = test::compiled(test::with_objects({ball}));
    candidates.gather(beside.world, square.shaft(), {}, false);
    CHECK_FALSE(candidates.is_dark());
    CHECK(candidates.list().size() == 1);
  }
}
