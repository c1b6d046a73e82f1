// What a cell says of a light – lit, dark, or a list of what may hide it – against rays from its points.
#include <doctest/doctest.h>

#include <algorithm>

#include "engine/accel/queries.h"
#include "engine/shading/shadows/cell.h"
#include "tests/robustness/worlds.h"

using namespace penumbra;
namespace shadows = penumbra::shading::shadows;
using math::Vec3;
using shadows::CellContents;
using Verdict = CellContents::Verdict;

namespace {

constexpr scene::MaterialId opaque{0}, pane{1};

scene::Description with_materials(std::vector<scene::Object> objects) {
  scene::Description description = test::with_objects(std::move(objects));
  scene::Material clear = scene::default_material();
  clear.transmission = math::grey(0.5);
  description.materials.push_back(clear);
  return description;
}

scene::Object random_object(test::Random& random, const Vec3& around = {}, double reach = 4) {
  scene::Object object;
  const Vec3 at = around + random.in_cube(reach);
  const double size = random.between(0.05, random.below(3) == 0 ? 5 : 1);
  switch (random.below(5)) {
    case 0:
      object.shape = scene::Sphere{at, size};
      break;
    case 1:
      object.shape = scene::Plane{at, random.direction()};
      break;
    case 2:
      object.shape = scene::Cylinder{at, random.direction(), size, random.between(0.1, 3), random.below(2) == 0};
      break;
    case 3:
      object.shape = scene::Tube{at, random.direction(), 0.3 * size};
      break;
    default:
      object.shape = scene::Triangle{
          {at + random.direction() * size, at + random.direction() * size, at + random.direction() * size}};
  }
  object.material = random.below(3) == 0 ? pane : opaque;
  return object;
}

/// A square cell and a target above it.
struct Place {
  math::Frame frame;
  Vec3 middle, u, v;
  shadows::FlatCell cell;
  shadows::Target target;

  Place(test::Random& random, bool is_infinite)
      : frame(math::frame_around(random.direction())), middle(random.in_cube(2)) {
    const double size = random.between(0.01, 0.3);
    u = frame.u * size, v = frame.v * size;
    cell = {{middle - u - v, middle + u - v, middle + u + v, middle - u + v}, frame.n};
    const Vec3 way = frame.n * random.between(2, 5) + frame.u * random.between(-2, 2) + frame.v * random.between(-2, 2);
    target = is_infinite ? shadows::Target{math::normalize(way), random.between(0, 0.1), true}
                         : shadows::Target{middle + way, random.between(0, 0.3), false};
  }
  double limit() const { return target.is_infinite ? math::infinity : 1; }
  geometry::Ray ray(test::Random& random) const {
    const Vec3 from = middle + u * random.between(-1, 1) + v * random.between(-1, 1);
    const Vec3 to = target.center + random.direction() * (target.radius * random.between(0, 1));
    return {from, target.is_infinite ? to : to - from, {}};
  }
};

}  // namespace

TEST_CASE("what a cell says holds for every segment from it to the light") {
  test::Random random(91);
  int lit = 0, dark = 0, listed = 0, blocked = 0;
  for (int round = 0; round < 3000; ++round) {
    const Place place(random, round % 3 == 0);
    const Vec3 between =
        place.middle + (place.target.is_infinite ? place.target.center : place.target.center - place.middle) * 0.5;
    std::vector<scene::Object> objects;
    for (int i = 0; i <= random.below(4); ++i)
      objects.push_back(round % 2 == 0 ? random_object(random) : random_object(random, between, 0.5));
    const shading::Scene scene = test::compiled(
        with_materials(objects), round % 4 == 0 ? scene::Acceleration::median : scene::Acceleration::bvh);
    const CellContents contents(scene.world, place.cell, place.target, {});
    REQUIRE(contents.verdict() != Verdict::unknown);
    lit += contents.verdict() == Verdict::lit ? 1 : 0, dark += contents.verdict() == Verdict::dark ? 1 : 0;
    listed += contents.verdict() == Verdict::listed ? 1 : 0;
    for (int k = 0; k < 20; ++k) {
      const geometry::Ray ray = place.ray(random);
      accel::Crossed crossed, of_list;
      const bool is_free = accel::cross_transparent(scene.world, ray, place.limit(), crossed);
      blocked += is_free ? 0 : 1;
      if (contents.verdict() == Verdict::lit) CHECK((is_free && crossed.sorted().empty()));
      if (contents.verdict() == Verdict::dark) CHECK_FALSE(is_free);
      if (contents.verdict() != Verdict::listed) continue;
      CHECK(shadows::cross_transparent(scene.world, contents, ray, place.limit(), of_list) == is_free);
      if (is_free) CHECK(of_list.sorted() == crossed.sorted());
    }
  }
  CHECK(lit > 300);
  CHECK(dark > 100);
  CHECK(listed > 300);
  CHECK(blocked > 5000);
}

TEST_CASE("a plane that neither cell nor light reaches is not listed, on either side of it") {
  test::Random random(92);
  int beside = 0;
  for (int round = 0; round < 4000; ++round) {
    const Place place(random, round % 3 == 0);
    const Vec3 point = random.in_cube(8), normal = random.direction();
    const auto side = [&](const Vec3& p) { return math::dot(normal, p - point); };
    const double end = place.target.is_infinite ? math::dot(normal, place.target.center) : side(place.target.center);
    const double margin = place.target.radius + 1e-9;
    const auto& corners = place.cell.corners;
    const bool is_above = end > margin && std::ranges::all_of(corners, [&](const Vec3&p) { return side(p) > 1e-9; }),
               is_below = end < -margin && std::ranges::all_of(corners, [&](const Vec3&p) { return side(p) < -1e-9; });
    const bool is_beside = is_above || is_below;
    const shading::Scene scene = test::compiled(with_materials({{scene::Plane{point, normal}, opaque}}));
    const CellContents contents(scene.world, place.cell, place.target, {});
    CHECK((contents.verdict() == Verdict::lit) == is_beside);
    beside += is_beside ? 1 : 0;
  }
  CHECK(beside > 1000);
  CHECK(beside < 3000);
}

TEST_CASE("one ball or triangle between a cell and a light hides all of it") {
  test::Random random(93);
  for (int round = 0; round < 500; ++round) {
    const Place place(random, false);
    const Vec3 way = place.target.center - place.middle, at = place.middle + way * 0.5;
    const double radius = 1.5 * math::length(place.u) + place.target.radius + 0.1;
    const math::Frame frame = math::frame_around(math::normalize(way));
    const Vec3 a = frame.u * 9, b = frame.v * 9;
    for (const scene::Object& object : {scene::Object{scene::Sphere{at, radius}, opaque},
                                        scene::Object{scene::Triangle{{at - a - b, at + a - b, at + b}}, opaque},
                                        scene::Object{scene::Triangle{{at + b, at + a - b, at - a - b}}, opaque}}) {
      const shading::Scene scene = test::compiled(with_materials({object}));
      CHECK(CellContents(scene.world, place.cell, place.target, {}).verdict() == Verdict::dark);
      // As far beside, or behind the light, it hides nothing.
      for (const Vec3& moved : {frame.u * 20, way * 3, place.frame.n * -30}) {
        scene::Object apart = object;
        if (auto* sphere = std::get_if<scene::Sphere>(&apart.shape)) sphere->center += moved;
        if (auto* triangle = std::get_if<scene::Triangle>(&apart.shape)) {
          for (Vec3& vertex : triangle->vertices) vertex += moved;
        }
        const shading::Scene empty = test::compiled(with_materials({apart}));
        CHECK(CellContents(empty.world, place.cell, place.target, {}).verdict() == Verdict::lit);
      }
    }
  }
}

TEST_CASE("an outline lists what light goes through, whatever surface the cell is on") {
  test::Random random(94);
  int outlined = 0, crossings = 0;
  for (int round = 0; round < 600; ++round) {
    std::vector<scene::Object> objects;
    const Place place(random, false);
    for (int i = 0; i < 20; ++i) {
      objects.push_back(random_object(random));
      objects.back().material = pane;
    }
    // The surface the cell is on, which is a pane too.
    objects.push_back({scene::Triangle{{place.middle - place.u * 99 - place.v * 99,
                                        place.middle + place.u * 99 - place.v * 99, place.middle + place.v * 99}},
                       pane});
    const shading::Scene scene = test::compiled(with_materials(objects));
    const geometry::SurfaceId self{20, 0};
    const CellContents contents = CellContents::outlined(scene.world, place.cell, place.target, self);
    REQUIRE(contents.outline() != nullptr);
    ++outlined;
    for (int k = 0; k < 20; ++k) {
      geometry::Ray ray = place.ray(random);
      ray.self = self;
      accel::Crossed crossed, of_list;
      CHECK(accel::cross_transparent(scene.world, ray, 1, crossed));
      CHECK(shadows::cross_transparent(scene.world, contents, ray, 1, of_list));
      CHECK(of_list.sorted() == crossed.sorted());
      crossings += static_cast<int>(crossed.sorted().size());
    }
  }
  CHECK(outlined == 600);
  CHECK(crossings > 5000);
}

TEST_CASE("an outline is given up or not whatever structure is searched") {
  test::Random random(95);
  int outlined = 0, given_up = 0;
  for (int round = 0; round < 600; ++round) {
    std::vector<scene::Object> objects;
    const Place place(random, false);
    for (int i = 0; i < 6; ++i) {
      const Vec3 at = random.in_cube(6);
      const auto vertex = [&] { return at + random.direction() * random.between(0.5, 4); };
      objects.emplace_back().shape = scene::Triangle{{vertex(), vertex(), vertex()}};
    }
    const auto contents = [&](scene::Acceleration acceleration) {
      scene::Description description = with_materials(objects);
      scene::PointLight soft;
      soft.radius = 1;
      description.lights.push_back(soft);  // so that silhouettes are asked for
      const shading::Scene scene = test::compiled(description, acceleration);
      return CellContents::outlined(scene.world, place.cell, place.target, {0, 0});
    };
    const CellContents one = contents(scene::Acceleration::bvh), other = contents(scene::Acceleration::median);
    CHECK((one.outline() == nullptr) == (other.outline() == nullptr));
    (one.outline() == nullptr ? given_up : outlined) += 1;
  }
  MESSAGE(outlined, " outlines, ", given_up, " given up");
  CHECK(outlined > 100);
  CHECK(given_up > 10);
}
