// Cells that neighbouring points share: how wide they are, and when they are not worth their while.
#include "engine/shading/shadows/light_cells.h"

#include <doctest/doctest.h>

#include "tests/robustness/worlds.h"

using namespace penumbra;
namespace shadows = penumbra::shading::shadows;
using math::Vec3;
using shadows::LightCells;

namespace {

/// A ball at the origin with two points on it, `others`, and so many balls elsewhere that a search costs something.
shading::Scene scene_with(std::vector<scene::Sphere> others, int elsewhere = 400,
                          scene::Acceleration acceleration = scene::Acceleration::bvh) {
  std::vector<scene::Object> objects(1);
  objects[0].shape = scene::Sphere{{}, 0.75};
  for (const scene::Sphere& sphere : others) objects.emplace_back().shape = sphere;
  for (int i = 0; i < elsewhere; ++i)
    objects.emplace_back().shape = scene::Sphere{{i % 20 * 1.0, i / 20 * 1.0, -500}, 0.1};
  return test::compiled(test::with_objects(std::move(objects)), acceleration);
}

/// On the ball, where cubes are from 0 to 1: ten pixels are a little wider.
shading::ShadingPoint on_ball() {
  shading::ShadingPoint at;
  at.facing = at.surface.normal = at.surface.shading_normal = math::normalize(Vec3{1, 1, 1});
  at.surface.position = at.facing * 0.75;
  at.id = {0, 0};
  at.footprint = 0.12;
  return at;
}

constexpr shadows::Target lamp{{0.5, 0.5, 100}, 0.5};

}  // namespace

TEST_CASE("what a cube's points share is about the hull of the ball around it, and no wider") {
  // The ball's radius is half a diagonal, 0.87, and its hull nowhere more than √2 times as wide.
  for (const bool is_listed : {true, false}) {
    const double off = is_listed ? 0.45 : 1.35;
    const shading::Scene scene = scene_with({{{0.5 + off, 0.5, 3}, 0.05}, {{0.5, 0.5 - off, 4}, 0.05}});
    LightCells cells(scene.world);
    const shadows::CellContents* contents = cells.find(on_ball(), 0, lamp, true);
    REQUIRE(contents != nullptr);
    REQUIRE(contents->outline() != nullptr);
    CHECK(contents->outline()->spheres.size() == (is_listed ? 3 : 1));  // the ball itself is one
  }
}

TEST_CASE("no cells where searching anew costs no more, or where there is no tree to search") {
  const shading::Scene few = scene_with({{{0.5, 0.5, 3}, 0.05}}, 0), many = scene_with({}),
                       without = scene_with({}, 400, scene::Acceleration::none);
  CHECK(LightCells(few.world).find(on_ball(), 0, lamp, true) == nullptr);
  CHECK(LightCells(many.world).find(on_ball(), 0, lamp, true) != nullptr);
  CHECK(LightCells(without.world).find(on_ball(), 0, lamp, true) == nullptr);
}

TEST_CASE("cells rest for a while where hardly anything is asked for twice, and only there") {
  const shading::Scene scene = scene_with({});
  LightCells used(scene.world), unused(scene.world);
  for (std::size_t i = 0; i < 5000; ++i) REQUIRE(used.find(on_ball(), i / 10, lamp, true) != nullptr);
  std::size_t answered = 0;
  while (answered < 2000 && unused.find(on_ball(), answered, lamp, true) != nullptr) ++answered;
  CHECK(answered < 2000);
  // One thirty-third of the questions is answered, so that the answers cost little.
  std::size_t turned_down = 1;
  while (turned_down < 100'000 && unused.find(on_ball(), 0, lamp, true) == nullptr) ++turned_down;
  CHECK(turned_down > 10 * answered);
  CHECK(turned_down < 100 * answered);
}
