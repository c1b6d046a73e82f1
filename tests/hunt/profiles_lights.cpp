// Every kind of light.
#include "tests/hunt/maker.h"

namespace penumbra::hunt {
namespace {

void hard_lights(Maker& m) {
  m.floor(m.matt());
  m.clutter(4);
  for (int i = 1 + m.below(3); i > 0; --i)
    m.chance(0.6) ? m.point_light(m.point(3, 2, 5), 0, 0.7) : m.sun(m.point(1, -2, -0.5), 0);
}

void spots(Maker& m) {
  m.floor(m.shiny());
  m.clutter(2);
  for (int i = 1 + m.below(2); i > 0; --i) {
    const Vec3 at = m.point(2.5, 1.5, 4);
    m.spot_light(at, m.point(1, 0, 0.5) - at, m.chance(0.4) ? 0 : m.in(0.1, 1));
  }
}

void suns(Maker& m) {
  m.floor(m.matt());
  m.clutter(3);
  m.sun(m.point(1.5, -1.5, -0.3), m.random.wide(0.1, 35));
  if (m.chance(0.3)) m.sun(m.point(1, -0.05, 0.1), m.in(1, 20));
}

void many_lights(Maker& m) {
  m.floor(m.matt());
  m.clutter(3);
  const Vec3 at = m.point(2, 2, 4);
  const double radius = m.in(0, 0.5);
  for (int i = 4 + m.below(10); i > 0; --i) {
    // Some are one and the same.
    if (m.chance(0.4))
      m.point_light(at, radius, 0.2);
    else
      m.point_light(m.point(3, 1.5, 5), m.chance(0.5) ? 0 : m.in(0.05, 0.6), 0.15);
  }
}

void crowds_of_lights(Maker& m) {
  m.chance(0.7) ? m.floor(m.matt()) : m.floor(m.shiny());
  m.clutter(3);
  for (int i = 9 + m.below(24); i > 0; --i) {
    const Vec3 at = m.point(4, 2, 5);
    if (m.chance(0.4))
      m.spot_light(at, m.point(1, 0, 0.5) - at, m.chance(0.5) ? 0 : m.in(0.05, 0.3));
    else
      m.point_light(at, m.chance(0.5) ? 0 : m.in(0.05, 0.3), 0.08);
  }
}

void panels(Maker& m) {
  m.floor(m.matt());
  m.clutter(3);
  const double y = m.in(2, 4);
  m.panel({m.in(-2, 0), y, m.in(-1, 0)}, {m.in(0.5, 2), 0, 0}, {m.chance(0.4) ? m.in(-0.5, 0.5) : 0.0, 0, m.in(0.5, 2)},
          m.in(2, 8));
}

void panel_in_ceiling(Maker& m) {
  m.floor(m.matt());
  m.clutter(2);
  const double y = m.in(2, 3.5);
  m.object(m.rectangle({-3, y, -3}, {6, 0, 0}, {0, 0, 6}), m.matt());
  m.panel({m.in(-1, 0), y, m.in(-1, 0)}, {m.in(0.5, 1.5), 0, 0}, {0, 0, m.in(0.5, 1.5)}, m.in(2, 8));
  if (m.chance(0.5)) m.object(m.rectangle({-3, 0, -3}, {6, 0, 0}, {0, y, 0}), m.matt());
}

void panel_upright(Maker& m) {
  m.floor(m.shiny());
  m.clutter(2);
  m.panel({m.in(-2, 0), m.chance(0.5) ? 0 : m.in(-0.3, 0.5), -2}, {m.in(1, 3), 0, 0}, {0, m.in(1, 2.5), 0}, m.in(1, 5));
}

void huge_panel(Maker& m) {
  m.floor(m.matt());
  m.object(m.sphere({0, 1, 0}, 1), m.shiny());
  const double half = m.random.wide(10, 1e5);
  m.panel({-half, m.in(3, 6), -half}, {2 * half, 0, 0}, {0, 0, 2 * half}, 1);
}

void lamps(Maker& m) {
  m.floor(m.matt());
  m.clutter(3);
  m.lamp(m.point(2, 2, 4), m.random.wide(0.1, 1.2), m.in(2, 10));
}

void shown_lamp(Maker& m) {
  m.floor(m.matt());
  m.clutter(2);
  const Vec3 at = m.point(1.5, 1.2, 2.5);
  const double radius = m.in(0.2, 0.8);
  m.object(m.sphere(at, radius), {{"emission", m.in(0.5, 2)}, {"diffuse", m.chance(0.5) ? 0.5 : 0}});
  m.lamp(at, radius, m.in(1, 6));
}

void lamp_around(Maker& m) {
  m.floor(m.matt());
  m.clutter(2);
  m.lamp(m.point(1, 0, 1), m.in(1.5, 12), m.in(0.3, 1));
}

void lamp_meets_floor(Maker& m) {
  m.floor(m.matt());
  m.clutter(1);
  const double radius = m.in(0.3, 1);
  m.lamp({m.in(-1, 1), m.chance(0.5) ? radius : m.in(-0.5, 1) * radius, m.in(-1, 1)}, radius, m.in(1, 4));
}

void highlights(Maker& m) {
  Json material = m.shiny();
  if (m.chance(0.3)) material["shininess"] = 0;
  m.floor(material);
  m.object(m.sphere({0, 0.9, 0}, 0.9), m.shiny());
  m.object(m.ball_mesh({1.6, 0.8, 0}, 0.6, 5, true), m.shiny());
  m.any_light();
  m.any_light();
}

void extremes(Maker& m) {
  m.floor(m.matt());
  m.clutter(2);
  m.point_light(m.point(2, 1.5, 4), m.in(0.1, 1), m.random.wide(1e-3, 1e4));
  Json& light = m.scene["lights"].back();
  if (m.chance(0.5))
    light["attenuation"] = {m.chance(0.5) ? 0.0 : m.random.wide(1e-3, 1e3), m.random.wide(1e-3, 10),
                            m.random.wide(1e-3, 10)};
}

void close_lights(Maker& m) {
  // As wide as they are far, or wider.
  m.floor(m.matt());
  m.object(m.sphere({0, 0.7, 0}, 0.7), m.shiny());
  m.clutter(1);
  const Vec3 at = m.direction() * m.in(0.75, 1.2) + Vec3{0, 0.9, 0};
  m.point_light(at.y < 0.1 ? Vec3{at.x, 0.3 - at.y, at.z} : at, m.in(0.3, 2), 0.7);
}

}  // namespace

std::vector<Profile> light_profiles() {
  return {{"hard-lights", hard_lights},
          {"spots", spots},
          {"suns", suns},
          {"crowds-of-lights", crowds_of_lights},
          {"many-lights", many_lights},
          {"panels", panels},
          {"panel-in-ceiling", panel_in_ceiling},
          {"panel-upright", panel_upright},
          {"huge-panel", huge_panel},
          {"lamps", lamps},
          {"shown-lamp", shown_lamp},
          {"lamp-around", lamp_around},
          {"lamp-meets-floor", lamp_meets_floor},
          {"highlights", highlights},
          {"extremes", extremes},
          {"close-lights", close_lights}};
}

}  // namespace penumbra::hunt
