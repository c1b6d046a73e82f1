// Every shape, and how it is placed.
#include "tests/hunt/maker.h"

namespace penumbra::hunt {
namespace {

void clutters(Maker& m) {
  m.floor(m.any_material());
  m.clutter(6);
  m.any_light(), m.any_light();
}

void ball_pile(Maker& m) {
  m.floor(m.matt());
  const Json material = m.chance(0.8) ? m.matt() : m.pane();
  for (int i = 10 + m.below(40); i > 0; --i)
    m.object(m.sphere(m.point(1.5, 0.2, 2), m.random.wide(0.05, 0.5)), material);
  m.soft_light();
}

void fine_mesh(Maker& m) {
  m.floor(m.matt());
  const int steps = 6 + m.below(8);
  m.object(m.chance(0.5) ? m.ball_mesh({0, 1.1, 0}, m.in(0.5, 1), steps, m.chance(0.5))
                         : m.ring_mesh({0, 1.2, 0}, 0.8, m.in(0.1, 0.3), steps, m.chance(0.5)),
           m.chance(0.7) ? m.matt() : m.shiny());
  m.soft_light();
}

void smooth(Maker& m, bool has_bare_corners) {
  m.floor(m.matt());
  Json mesh = m.ball_mesh({0, 1, 0}, 0.9, 3 + m.below(4), true);
  for (std::size_t i = 0; i < 6 && has_bare_corners; ++i) mesh["normals"][3 + i] = 0;
  m.object(mesh, m.chance(0.3) ? m.mirror() : m.chance(0.3) ? m.glass() : m.shiny());
  m.any_light();
}
void smooth_mesh(Maker& m) { smooth(m, false); }
void bare_corners(Maker& m) { smooth(m, true); }

void instances(Maker& m) {
  m.floor(m.matt());
  m.scene["meshes"]["box"] = m.box({-0.4, -0.4, -0.4}, {0.4, 0.4, 0.4});
  m.scene["meshes"]["ball"] = m.ball_mesh({0, 0, 0}, 0.6, 4, true);
  m.scene["meshes"]["ring"] = m.ring_mesh({0, 0, 0}, 0.5, 0.15, 8, false);
  for (auto& [name, mesh] : m.scene["meshes"].items()) mesh.erase("type");
  for (int i = 3 + m.below(3); i > 0; --i) {
    const char* names[]{"box", "ball", "ring"};
    m.object(m.placed(names[m.below(3)], m.skewed(m.point(1.7, 0.7, 1.5), m.in(0.5, 1.2))), m.any_material());
  }
  m.soft_light();
}

void groups(Maker& m) {
  m.floor(m.matt());
  for (int i = 1 + m.below(2); i >= 0; --i) {
    const Json outside = m.scene["objects"];
    m.scene["objects"] = Json::array();
    m.object(m.sphere({0, 0, 0}, 0.6), m.any_material());
    m.object(m.cylinder({0.7, -0.5, 0}, m.direction(), 0.25, 1, m.chance(0.6)), m.any_material());
    m.object(m.star({0, 0.6, 0}, m.direction(), 0.6, 4), m.matt());
    if (m.chance(0.3)) m.object(m.ball_mesh({-0.7, 0, 0}, 0.4, 4, true), m.shiny());
    Json inner{
        {"type", "group"}, {"objects", m.scene["objects"]}, {"transform", m.matrix(m.skewed({0, 0, 0}, m.in(0.6, 1)))}};
    Json outer{{"type", "group"}, {"objects", {inner}}};
    if (m.chance(0.6)) outer["transform"] = m.matrix(m.skewed(m.point(1, 0.8, 1.4), 1));
    m.scene["objects"] = outside;
    m.scene["objects"].push_back(outer);
  }
  m.soft_light();
}

void tubes(Maker& m) {
  m.floor(m.matt());
  for (int i = 1 + m.below(3); i > 0; --i)
    m.object(m.tube(m.point(1.5, 0.5, 2), m.point(1, -0.3, 0.3), m.in(0.05, 0.5)), m.any_material());
  m.soft_light();
}

void cylinders(Maker& m) {
  m.floor(m.matt());
  for (int i = 2 + m.below(4); i > 0; --i)
    m.object(m.cylinder(m.point(1.5, 0.3, 1.5), m.direction(), m.random.wide(0.03, 0.6), m.random.wide(0.1, 2),
                        m.chance(0.5)),
             m.any_material());
  m.soft_light();
}

void stars(Maker& m) {
  m.floor(m.matt());
  for (int i = 2 + m.below(3); i > 0; --i)
    m.object(m.star(m.point(1.5, 0.7, 2.2), m.direction(), m.in(0.4, 1.2), 3 + m.below(6)),
             m.chance(0.7) ? m.matt() : m.pane());
  m.soft_light();
}

void triangle_soup(Maker& m) {
  m.floor(m.matt());
  for (int i = 5 + m.below(30); i > 0; --i) {
    const Vec3 p = m.point(1.7, 0.4, 2.4);
    m.object(m.triangle(p, p + m.direction() * 0.7, p + m.direction() * 0.7), m.chance(0.85) ? m.matt() : m.pane());
  }
  m.soft_light();
}

void nobody(Maker& m) {
  if (m.chance(0.7)) m.object(m.sphere(m.point(2, -1, 2), m.in(0.3, 1)), m.any_material());
  m.any_light();
}

void from_inside(Maker& m) {
  const int which = m.below(3);
  const Json shell = m.chance(0.8) ? m.matt() : m.mirror();
  if (which == 0) m.object(m.sphere({0, 1, 0}, 4), shell);
  if (which == 1) m.object(m.cylinder({0, -1, 0}, {0, 1, 0}, 3, 4), shell);
  if (which == 2) m.object(m.box({-3, -1, -3}, {3, 3, 3}), shell);
  m.clutter(3);
  m.camera({0.5, 1.5, 2.2}, m.point(0.5, 0.3, 1), 60);
  m.point_light(m.point(1.5, 1.5, 2.7), m.in(0, 1));
  if (m.chance(0.3)) m.lamp(m.point(1, 1.7, 2.5), m.in(0.1, 0.5), 5);
}

void walls_of_mesh(Maker& m) {
  // A city: boxes that stand on a floor of triangles.
  m.tiles({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, 3, 3, m.below(3), m.matt());
  for (int i = 3 + m.below(6); i > 0; --i) {
    const Vec3 at = m.point(2, 0, 0);
    m.object(m.box(at, at + Vec3{m.in(0.2, 0.9), m.in(0.3, 2), m.in(0.2, 0.9)}), m.matt());
  }
  m.soft_light();
  if (m.chance(0.3)) m.soft_light();
}

}  // namespace

std::vector<Profile> shape_profiles() {
  return {{"clutter", clutters},
          {"ball-pile", ball_pile},
          {"fine-mesh", fine_mesh},
          {"smooth-mesh", smooth_mesh},
          {"bare-corners", bare_corners},
          {"instances", instances},
          {"groups", groups},
          {"tubes", tubes},
          {"cylinders", cylinders},
          {"stars", stars},
          {"triangle-soup", triangle_soup},
          {"nobody", nobody},
          {"from-inside", from_inside},
          {"city", walls_of_mesh}};
}

}  // namespace penumbra::hunt
