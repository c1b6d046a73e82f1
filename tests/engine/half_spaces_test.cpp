// Regions bounded by planes: what touches them is not missed, what is clearly apart is.
#include "engine/accel/half_spaces.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"
#include "tests/robustness/worlds.h"

using namespace penumbra;
using accel::HalfSpaces;
using math::Vec3;

namespace {

constexpr double reach = 10;
const math::Bounds everywhere{{-math::infinity, -math::infinity, -math::infinity},
                              {math::infinity, math::infinity, math::infinity}};

struct Plane {
  Vec3 base, outward;
  double offset;
  explicit Plane(test::Random& random)
      : base(random.in_cube(3)), outward(random.direction() * random.between(0.1, 5)), offset(random.between(-3, 3)) {}
  HalfSpaces region() const {
    HalfSpaces region(base, reach, everywhere);
    region.add(outward, offset);
    return region;
  }
  /// How far outside, by a unit normal.
  double beyond(const Vec3& p) const { return (math::dot(outward, p - base) - offset) / math::length(outward); }
  Vec3 at(test::Random& random, double beyond_it) const {
    const Vec3 p = random.in_cube(4);
    return p + math::normalize(outward) * (beyond_it - beyond(p));
  }
};

}  // namespace

TEST_CASE("what touches the box of a region is not missed, and what is apart by more than rounding is") {
  test::Random random(51);
  for (int i = 0; i < 2000; ++i) {
    math::Bounds box;
    box.include(random.in_cube(5)), box.include(random.in_cube(5));
    const HalfSpaces region(random.in_cube(5), reach, box);
    for (int axis = 0; axis < 3; ++axis) {
      for (const bool is_above : {false, true}) {
        math::Bounds beside = box;
        const double size = random.between(0, 1), gap = 1e-12 * reach;
        for (const bool is_apart : {false, true}) {
          const double face =
              is_above ? box.upper[axis] + (is_apart ? gap : 0) : box.lower[axis] - (is_apart ? gap : 0);
          beside.lower[axis] = is_above ? face : face - size, beside.upper[axis] = is_above ? face + size : face;
          CHECK(region.miss(beside) == is_apart);
          const Vec3 across[2]{beside.lower, beside.upper};
          CHECK(region.miss(geometry::TriangleVertices{across[0], across[1], (across[0] + across[1]) * 0.5}) ==
                is_apart);
          const Vec3 middle = (beside.lower + beside.upper) * 0.5;
          Vec3 center = middle;
          center[axis] = is_above ? face + size : face - size;
          if (is_apart) center[axis] += is_above ? gap : -gap;
          CHECK(region.miss(geometry::SphereShape{center, size}) == is_apart);
        }
      }
    }
  }
}

TEST_CASE("a plane rejects what lies wholly beyond it, and nothing that touches it") {
  test::Random random(52);
  constexpr double gap = 1e-11 * reach;
  for (int i = 0; i < 5000; ++i) {
    const Plane plane(random);
    const HalfSpaces region = plane.region();
    const Vec3 out = math::normalize(plane.outward);
    for (const double beyond : {0.0, gap}) {
      const bool is_apart = beyond > 0;
      const Vec3 nearest = plane.at(random, beyond);
      const double radius = random.between(0, 2);
      CHECK(region.miss(geometry::SphereShape{nearest + out * radius, radius}) == is_apart);
      const auto farther = [&] { return plane.at(random, beyond + random.between(0, 3)); };
      CHECK(region.miss(geometry::TriangleVertices{nearest, farther(), farther()}) == is_apart);
      CHECK(region.miss(geometry::TriangleVertices{farther(), nearest, farther()}) == is_apart);
      CHECK(region.miss(geometry::TriangleVertices{farther(), farther(), nearest}) == is_apart);
      const Vec3 size{random.between(0, 2), random.between(0, 2), random.between(0, 2)};
      // Its corner towards the plane.
      math::Bounds box;
      box.include(nearest);
      box.include(nearest +
                  Vec3{std::copysign(size.x, out.x), std::copysign(size.y, out.y), std::copysign(size.z, out.z)});
      CHECK(region.miss(box) == is_apart);
    }
  }
}

TEST_CASE("a plane rejects a cylinder whose rims lie beyond it, and none of which a point does not") {
  test::Random random(53);
  constexpr int points = 256;
  int missed = 0;
  for (int i = 0; i < 3000; ++i) {
    const Plane plane(random);
    const Vec3 axis = i % 4 == 0 ? math::normalize(plane.outward) : random.direction();
    const geometry::CylinderShape cylinder{random.in_cube(6), axis, random.between(0.001, 2), random.between(0.001, 4),
                                           true};
    const math::Frame frame = math::frame_around(axis);
    double nearest = math::infinity;
    for (int k = 0; k < points; ++k) {
      const auto [sine, cosine] = math::sine_cosine_turns(static_cast<double>(k) / points);
      const Vec3 rim = cylinder.base + (frame.u * cosine + frame.v * sine) * cylinder.radius;
      nearest = std::min({nearest, plane.beyond(rim), plane.beyond(rim + axis * cylinder.height)});
    }
    if (nearest < 0) CHECK_FALSE(plane.region().miss(cylinder));
    // Between two of the points a rim comes nearer by less than this; the test allows single precision of the axis.
    if (nearest > 1e-3 * cylinder.radius + 1e-9) CHECK(plane.region().miss(cylinder));
    missed += nearest > 1e-3 ? 1 : 0;
  }
  CHECK(missed > 500);
}

TEST_CASE("a cylinder that reaches a plane by next to nothing is not missed, whatever way the plane faces") {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      Vec3 outward, along;
      outward[axis] = sign, along[(axis + 1) % 3] = 1;
      HalfSpaces region({}, reach, everywhere);
      region.add(outward, 1);
      for (const double radius : {0.5, 2.0}) {
        for (const double beyond : {-1e-9, 1e-3}) {
          const geometry::CylinderShape cylinder{outward * (1 + radius + beyond), along, radius, 3, true};
          CHECK(region.miss(cylinder) == (beyond > 0));
        }
      }
    }
  }
}

TEST_CASE("single precision rejects nothing that double precision keeps") {
  test::Random random(54);
  int outside = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Plane plane(random);
    const Vec3 origin = random.in_cube(5);
    const HalfSpaces::FloatPlanes planes = plane.region().in_single_precision(origin);
    REQUIRE(planes.count == 1);
    const HalfSpaces::FloatPlanes::Plane& single = planes.plane[0];
    const double beyond = std::ldexp(random.between(-1, 1), -random.below(30));
    const Vec3 point = plane.at(random, beyond) - origin;
    double value = -double{single.offset}, largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      value += double{single.outward[axis]} * static_cast<float>(point[axis]);
      largest = std::max(largest, std::fabs(point[axis]));
    }
    const bool is_outside = value > single.slack + largest * single.rounding;
    if (beyond < 0) CHECK_FALSE(is_outside);
    if (beyond > 1e-4) CHECK(is_outside);
    outside += is_outside ? 1 : 0;
  }
  CHECK(outside > 3000);
}
