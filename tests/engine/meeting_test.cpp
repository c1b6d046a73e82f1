// Whether segments to a disc meet a shape: against points of them, close together.
#include "engine/shading/shadows/meeting.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"
#include "tests/robustness/worlds.h"

using namespace penumbra;
using accel::Kind;
using math::Vec3;
using shading::shadows::DiscView;

namespace {

DiscView random_view(test::Random& random) {
  const math::Frame frame = math::frame_around(random.direction());
  const double radius = random.between(0, 1);
  return {random.in_cube(2), frame.n * random.between(1, 5), frame.u * radius, frame.v * radius, random.below(3) == 0};
}

/// Of one shape near `at`, which may be placed.
accel::World world_of(test::Random& random, Kind kind, Vec3 at) {
  accel::World world;
  world.items.push_back({kind, true, 0, accel::no_placement});
  const Vec3 a = random.direction() * random.between(0.5, 2), b = random.direction() * random.between(0.5, 2);
  if (random.below(2) == 0 && math::length(math::cross(a, b)) > 0.2) {
    const math::Affine map{{a, b, math::normalize(math::cross(a, b)) * random.between(0.5, 2)}, random.in_cube(1)};
    world.items[0].placement = 0;
    world.placements.push_back({map, math::inverse(map)});
    at = world.placements[0].world_to_local.point(at);
  }
  const Vec3 axis = random.direction();
  const double radius = random.between(0.05, 1);
  if (kind == Kind::sphere) world.spheres.push_back({at, radius});
  if (kind == Kind::tube) world.tubes.push_back({at, axis, radius});
  if (kind == Kind::cylinder) world.cylinders.push_back({at, axis, radius, random.between(0.1, 3), true});
  return world;
}

/// How far a point of the world is outside, in the shape's own space; below 0 inside.
double beyond(const accel::World& world, const Vec3& point) {
  const accel::Item& item = world.items[0];
  const Vec3 p = item.placement == accel::no_placement ? point : world.placements[0].world_to_local.point(point);
  if (item.kind == Kind::sphere) return math::length(p - world.spheres[0].center) - world.spheres[0].radius;
  const bool is_tube = item.kind == Kind::tube;
  const Vec3 base = is_tube ? world.tubes[0].point : world.cylinders[0].base,
             axis = is_tube ? world.tubes[0].axis : world.cylinders[0].axis;
  const double along = math::dot(p - base, axis), across = math::length(p - base - axis * along);
  if (is_tube) return across - world.tubes[0].radius;
  const geometry::CylinderShape& cylinder = world.cylinders[0];
  return std::max({across - cylinder.radius, -along, along - cylinder.height});
}

/// The least of `beyond` on segments to the disc, from points some `spacing` apart.
double nearest(const DiscView& view, const accel::World& world) {
  double least = math::infinity;
  for (int ring = 0; ring <= 8; ++ring) {
    const int turns = std::max(1, 6 * ring);
    for (int turn = 0; turn < turns; ++turn) {
      const auto [sine, cosine] = math::sine_cosine_turns(static_cast<double>(turn) / turns);
      const Vec3 way = view.at(cosine * ring / 8.0, sine * ring / 8.0);
      const double length = math::length(way), end = view.is_infinite ? 25 / length : 1;
      const int steps = static_cast<int>(std::ceil(length * end / 0.1));
      for (int step = 0; step <= steps; ++step)
        least = std::min(least, beyond(world, view.from + way * (end * step / steps)));
    }
  }
  return least;
}

}  // namespace

TEST_CASE("segments to a disc are said to meet a shape if one does") {
  test::Random random(81);
  int met = 0, missed = 0;
  for (int i = 0; i < 900; ++i) {
    const Kind kind = i % 3 == 0 ? Kind::sphere : i % 3 == 1 ? Kind::tube : Kind::cylinder;
    DiscView view = random_view(random);
    // An endless tube and endless segments are always said to meet.
    if (kind == Kind::tube) view.is_infinite = false;
    const Vec3 on_way = view.from + view.at(0, 0) * random.between(0, 1);
    const accel::World world = world_of(random, kind, on_way + random.in_cube(random.below(2) == 0 ? 1 : 4));
    const double least = nearest(view, world);
    const bool meets = shading::shadows::meets_segments(view, world, world.items[0]);
    if (least < 0) CHECK(meets);
    // Between the points there is room for no more; a map stretches it at most sixfold or so.
    if (least > (view.is_infinite ? 3 : 0.6)) CHECK_FALSE(meets);
    met += meets ? 1 : 0, missed += meets ? 0 : 1;
  }
  CHECK(met > 200);
  CHECK(missed > 200);
}

TEST_CASE("segments that graze a sphere, a tube or a cylinder meet it, and those beside it do not") {
  test::Random random(82);
  for (int i = 0; i < 3000; ++i) {
    // One segment, with a disc of no size: the distance is that of two lines.
    const Vec3 from = random.in_cube(2), axis = random.direction() * 4, middle = from + axis * random.between(0.2, 0.8);
    const Vec3 along = random.direction();
    const Vec3 across = math::normalize(math::cross(axis, along));
    const double radius = random.between(0.1, 1);
    for (const double gap : {-1e-6, 1e-6}) {
      const Vec3 center = middle + across * (radius + gap);
      accel::World world;
      world.spheres.push_back({center, radius});
      world.tubes.push_back({center - along * 5, along, radius});
      world.cylinders.push_back({center - along * 2, along, radius, 4, true});
      const DiscView view{from, axis, {}, {}, false};
      for (const Kind kind : {Kind::sphere, Kind::tube, Kind::cylinder}) {
        const accel::Item item{kind, true, 0, accel::no_placement};
        CHECK(shading::shadows::meets_segments(view, world, item) == (gap < 0));
      }
    }
  }
}

TEST_CASE("a segment along an axis and spheres on a grid, where coordinates are often 0") {
  const DiscView view{{}, {0, 0, 4}, {}, {}, false};
  for (int i = 0; i < 11 * 11 * 11; ++i) {
    const Vec3 center{i % 11 - 5.0, i / 11 % 11 - 5.0, i / 121 - 2.0};
    const Vec3 nearest{0, 0, std::clamp(center.z, 0.0, 4.0)};
    accel::World world;
    world.spheres.push_back({center, 1});
    const accel::Item item{Kind::sphere, true, 0, accel::no_placement};
    const double distance = math::length(center - nearest);
    if (distance == 1) continue;
    CHECK(shading::shadows::meets_segments(view, world, item) == (distance < 1));
  }
}
