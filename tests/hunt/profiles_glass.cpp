// What transmits, refracts and mirrors.
#include "tests/hunt/maker.h"

namespace penumbra::hunt {
namespace {

void stack_of_panes(Maker& m) {
  m.floor(m.matt());
  const bool lies = m.chance(0.5);
  double at = m.in(0.2, 0.5);
  for (int i = 3 + m.below(6); i > 0; --i, at += m.in(0.02, 0.4)) {
    if (lies)
      m.object(m.rectangle({m.in(-2, -1), at, 1.5}, {3, 0, 0}, {0, 0, -3}), m.pane());
    else
      m.object(m.rectangle({m.in(-2, -1), 0, at}, {3, 0, 0}, {0, 2.5, 0}), m.pane());
  }
  m.options["max_depth"] = 3 + m.below(10);
  m.soft_light();
}

void stained_glass(Maker& m) {
  m.floor(m.matt());
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k)
      m.object(m.rectangle({-1.5 + i, 0.3 + k * 0.7, -1}, {1, 0, 0}, {0, 0.7, 0}), m.chance(0.8) ? m.pane() : m.matt());
  }
  m.chance(0.5) ? m.sun({m.in(-0.5, 0.5), m.in(-1, -0.4), m.in(0.5, 1)}, m.in(0.5, 8))
                : m.point_light({m.in(-1, 1), m.in(2, 4), -4}, m.in(0.2, 1));
}

void clear_solids(Maker& m) {
  m.floor(m.matt());
  for (int i = 2 + m.below(3); i > 0; --i) {
    const Vec3 at = m.point(1.5, 0.05, 0.8);
    const double size = m.in(0.3, 0.7);
    switch (m.below(4)) {
      case 0:
        m.object(m.sphere(at + Vec3{0, size, 0}, size), m.pane());
        break;
      case 1:
        m.object(m.box(at, at + Vec3{size, size, 0.4}), m.pane());
        break;
      case 2:
        m.object(m.cylinder(at, {0.1, 1, 0}, size, 0.8, m.chance(0.5)), m.pane());
        break;
      default:
        m.object(m.ball_mesh(at + Vec3{0, size, 0}, size, 4, false), m.pane());
    }
  }
  m.soft_light();
}

void lenses(Maker& m) {
  m.floor(m.matt());
  for (int i = 1 + m.below(2); i > 0; --i) m.object(m.sphere(m.point(1, 0.8, 1.2), m.in(0.4, 0.75)), m.glass());
  m.clutter(1);
  m.soft_light();
}

void prisms(Maker& m) {
  m.floor(m.matt());
  m.scene["meshes"]["box"] = m.box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
  m.scene["meshes"]["box"].erase("type");
  for (int i = 1 + m.below(2); i > 0; --i)
    m.object(m.placed("box", m.skewed(m.point(1, 1.2, 1.5), m.in(0.5, 1))), m.glass());
  m.options["max_depth"] = 4 + m.below(5);
  m.soft_light();
}

void nested_glass(Maker& m) {
  m.floor(m.matt());
  const Vec3 at{0, 1.1, 0};
  m.object(m.sphere(at, 1), m.glass());
  m.object(m.sphere(at, m.in(0.3, 0.9)), m.chance(0.6) ? m.glass() : m.matt());
  if (m.chance(0.3)) m.camera(at + m.direction() * 0.2, {0, 0.2, 3}, 60);
  m.soft_light();
}

void glass_cylinders(Maker& m) {
  m.floor(m.matt());
  m.object(m.cylinder({-0.7, 0.1, 0}, m.direction(), m.in(0.3, 0.6), m.in(0.6, 1.5)), m.glass());
  m.object(m.chance(0.5) ? m.tube({0, m.in(1.2, 2), -1}, {1, 0, 0.2}, 0.3)
                         : m.cylinder({0.8, 0, 0}, {0, 1, 0}, 0.4, 1.2, false),
           m.chance(0.5) ? m.glass() : m.pane());
  m.soft_light();
}

void mirrors(Maker& m) {
  m.floor(m.chance(0.5) ? m.mirror() : m.matt());
  m.object(m.rectangle({-3, 0, -2}, {6, 0, m.in(-1, 1)}, {0, 4, 0}), m.mirror());
  m.object(m.sphere(m.point(1, 0.7, 1), 0.6), m.mirror());
  m.clutter(1);
  m.soft_light();
}

void depths(Maker& m) {
  m.floor(m.mirror());
  m.object(m.rectangle({-2, 0.5, 1}, {4, 0, 0}, {0, 0.2, -3}), m.pane());
  m.object(m.sphere({0.3, 1.5, 0}, 0.6), m.chance(0.5) ? m.mirror() : m.pane());
  m.options["max_depth"] = m.below(5);
  m.options["min_contribution"] = m.chance(0.5) ? 0 : m.random.wide(1e-3, 0.7);
  m.soft_light();
}

void glowing(Maker& m) {
  m.scene["ambient"] = m.color(0, 0.3);
  m.floor(m.matt());
  for (int i = 0; i < 4; ++i) {
    Json material = m.any_material();
    material["emission"] = m.color(0, 2), material["ambient"] = m.color(0, 2);
    m.object(m.sphere(m.point(1.5, 0.4, 1.5), m.in(0.2, 0.5)), material);
  }
  m.any_light();
}

void coloured_channels(Maker& m) {
  // Opaque to one colour, clear to another.
  m.floor(m.matt());
  for (int i = 2 + m.below(3); i > 0; --i) {
    Json pane{{"diffuse", 0.1}, {"transmission", {0, 0, 0}}};
    pane["transmission"][static_cast<std::size_t>(m.below(3))] = m.chance(0.5) ? 1.0 : m.in(0.2, 0.9);
    m.object(m.rectangle({m.in(-1.5, -0.5), 0.3 + 0.4 * i, 1}, {2, 0, 0}, {0, m.in(0, 0.3), -2}), pane);
  }
  m.soft_light();
}

}  // namespace

std::vector<Profile> glass_profiles() {
  return {{"stack-of-panes", stack_of_panes},
          {"stained-glass", stained_glass},
          {"clear-solids", clear_solids},
          {"lenses", lenses},
          {"prisms", prisms},
          {"nested-glass", nested_glass},
          {"glass-cylinders", glass_cylinders},
          {"mirrors", mirrors},
          {"depths", depths},
          {"glowing", glowing},
          {"coloured-channels", coloured_channels}};
}

}  // namespace penumbra::hunt
