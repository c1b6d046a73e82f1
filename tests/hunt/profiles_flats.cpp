// Flats, whole and in pieces, and the discs that graze, cross and lie on them.
#include "tests/hunt/maker.h"

namespace penumbra::hunt {
namespace {

/// Close to the floor and as wide as it is long.
void low_disc(Maker& m) {
  const double radius = m.in(0.5, 2.5);
  m.point_light(m.point(4, 0.1, 1.2 * radius), radius, m.in(0.5, 2));
}

void tiles_low_disc(Maker& m) {
  const int across = 2 + m.below(5), along = 2 + m.below(5);
  m.tiles({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, across, along, m.below(3), m.matt());
  low_disc(m);
  if (m.chance(0.5)) m.clutter(1);
}

void outline_low_disc(Maker& m) {
  m.object(m.chance(0.5)
               ? m.star({0, 0, 0}, {0, 1, 0}, 6, 3 + m.below(4))
               : m.polygon({{-5, 0, -5}, {m.in(-7, -5.2), 0, m.in(-3, 3)}, {-5, 0, 5}, {5, 0, 5}, {5, 0, -5}}),
           m.matt());
  low_disc(m);
}

void mesh_floor_low_disc(Maker& m) {
  const int steps = 2 + m.below(6);
  m.scene["meshes"]["grid"] = m.grid_mesh(steps);
  const double step = 10.0 / steps;
  m.object(m.placed("grid", {{{step, 0, 0}, {0, 0, -step}, {0, 1, 0}}, {-5, 0, 5}}), m.matt());
  low_disc(m);
  if (m.chance(0.4)) m.clutter(1);
}

/// Of instances of one mesh, or of tiles; the camera is inside, and so are the lights.
void room(Maker& m, bool crosses) {
  const int steps = 1 + m.below(3);
  m.scene["meshes"]["grid"] = m.grid_mesh(steps);
  const double s = 4.0 / steps, h = 3.0 / steps;
  const Json material = m.matt();
  const Affine walls[]{{{{s, 0, 0}, {0, h, 0}, {0, 0, 1}}, {-2, 0, -2}},
                       {{{s, 0, 0}, {0, 0, -s}, {0, 1, 0}}, {-2, 0, 2}},
                       {{{s, 0, 0}, {0, 0, s}, {0, -1, 0}}, {-2, 3, -2}},
                       {{{0, 0, -s}, {0, h, 0}, {1, 0, 0}}, {-2, 0, 2}},
                       {{{0, 0, s}, {0, h, 0}, {-1, 0, 0}}, {2, 0, -2}}};
  for (const Affine& wall : walls) m.object(m.placed("grid", wall), material);
  m.camera({m.in(-0.5, 0.5), m.in(1, 2), m.in(3.5, 4.8)}, {m.in(-0.5, 0.5), 1.5, 0}, m.in(45, 70));
  m.point_light({m.in(-1, 1), crosses ? m.in(2.7, 2.95) : m.in(1.5, 2.2), m.in(-1, 1)},
                crosses ? m.in(0.4, 1.5) : m.in(0.1, 0.6), 0.8);
  if (m.chance(0.5)) m.object(m.box({-0.5, 0, -0.5}, {m.in(0, 0.7), m.in(0.3, 1.2), 0.3}), m.any_material());
}
void room_lamp(Maker& m) { room(m, false); }
void room_lamp_crosses(Maker& m) { room(m, true); }

void disc_crosses_wall(Maker& m) {
  m.floor(m.matt());
  const double x = m.in(-2, 2);
  m.object(m.rectangle({x, -0.0, 3}, {m.in(-1, 1), m.in(3, 5), 0}, {0, 0, -6}), m.chance(0.8) ? m.matt() : m.pane());
  m.point_light({x + m.in(-0.7, 0.7), m.in(1, 3), m.in(-2, 2)}, m.in(0.5, 1.5));
}

void disc_crosses_ball(Maker& m) {
  m.floor(m.matt());
  const Vec3 at = m.point(1.5, 1.5, 3);
  m.object(m.sphere(at, m.in(0.3, 0.8)), m.chance(0.7) ? m.shiny() : m.pane());
  m.point_light(at + m.direction() * m.in(0.3, 1.2), m.in(0.3, 1.5));
  if (m.chance(0.4)) m.object(m.sphere(m.point(2, 0.4, 1), 0.4), m.matt());
}

void disc_below_floor(Maker& m) {
  const double tilt = m.chance(0.5) ? 0.03 : 0;
  m.object(m.plane({0, 0, 0}, {m.in(-tilt, tilt), 1, m.in(-tilt, tilt)}), m.chance(0.8) ? m.matt() : m.pane());
  for (int i = m.below(3); i >= 0; --i) m.object(m.sphere(m.point(1.5, 0.3, 1), 0.5), m.matt());
  m.point_light(m.point(1.5, 0.1, 0.8), m.in(0.6, 1.6), 0.6);
}

void lamp_on_ceiling(Maker& m) {
  m.floor(m.matt());
  m.clutter(1);
  const double y = m.in(3, 4.5);
  if (m.chance(0.5))
    m.object(m.rectangle({-3, y, -3}, {6, 0, 0}, {0, 0, 6}), m.matt());
  else
    m.tiles({-3, y, -3}, {6, 0, 0}, {0, 0, 6}, 2, 2, m.below(3), m.matt());
  m.point_light({m.in(-1, 1), y, m.in(-1, 1)}, m.chance(0.5) ? 0 : m.in(0.2, 1));
  if (m.chance(0.3)) m.spot_light({m.in(-1, 1), y, m.in(-1, 1)}, {0, -1, 0}, 0);
}

void lamp_on_floor(Maker& m) {
  m.floor(m.matt());
  m.object(m.sphere({0, 1, 0}, 1), m.shiny());
  m.clutter(1);
  m.point_light({m.in(1.3, 3), 0, m.in(0.5, 3)}, m.chance(0.6) ? 0 : m.in(0.1, 0.8));
}

void lamp_on_wall(Maker& m) {
  m.floor(m.matt());
  const double z = m.in(-3, -1);
  m.object(m.rectangle({-3, 0, z}, {6, 0, 0}, {0, 4, 0}), m.chance(0.7) ? m.matt() : m.pane());
  m.clutter(1);
  m.point_light({m.in(-2, 2), m.in(1, 3), z}, m.chance(0.5) ? 0 : m.in(0.2, 0.8));
}

void slats(Maker& m) {
  m.floor(m.matt());
  const int count = 3 + m.below(8);
  const double y = m.in(0.5, 2.5), width = m.in(0.05, 0.25), tilt = m.in(-0.3, 0.3);
  const Json material = m.chance(0.8) ? m.matt() : m.pane();
  for (int i = 0; i < count; ++i)
    m.object(m.rectangle({-2, y, -1.5 + 3.0 * i / count}, {4, tilt, 0}, {0, m.chance(0.3) ? width : 0.0, width}),
             material);
  m.soft_light();
}

void slivers(Maker& m) {
  m.floor(m.matt());
  for (int i = 3 + m.below(10); i > 0; --i) {
    const Vec3 p = m.point(2, 0.3, 2.5), along = m.direction() * m.in(1, 4);
    m.object(m.triangle(p, p + along, p + along * 0.5 + m.direction() * m.random.wide(2e-3, 0.1)), m.matt());
  }
  m.soft_light();
}

void grid_in_line(Maker& m) {
  // Every pixel's ray meets an edge or a corner.
  const int pixels = 12, steps = m.chance(0.5) ? 12 : 6;
  m.tiles({-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, steps / 2, steps / 2, m.below(2), m.matt());
  m.scene["camera"] = {{"position", {m.chance(0.5) ? 0.25 : 0.0, 0.25, 6}},
                       {"direction", {0, 0, -1}},
                       {"projection", "orthographic"},
                       {"view_plane", {{"width", 6}, {"height", 6}}}};
  m.size(pixels, pixels);
  m.object(m.sphere({0.3, 0.2, 1}, 0.7), m.matt());
  m.point_light({m.in(-2, 2), m.in(-2, 2), m.in(1.5, 4)}, m.in(0.1, 1));
}

void huge_and_tiny(Maker& m) {
  const double far = m.random.wide(1e2, 1e5);
  m.object(m.triangle({-far, 0, -far}, {0, 0, 2 * far}, {2 * far, 0, -far}), m.matt());
  for (int i = 0; i < 6; ++i)
    m.object(m.triangle(m.point(1, 0.2, 1), m.point(1, 0.2, 1), m.point(1, 0.2, 1)), m.matt());
  for (int i = 0; i < 4; ++i) m.object(m.sphere(m.point(1, 0.2, 1.3), m.random.wide(5e-3, 0.2)), m.matt());
  m.soft_light();
}

}  // namespace

std::vector<Profile> flat_profiles() {
  return {{"tiles-low-disc", tiles_low_disc},
          {"outline-low-disc", outline_low_disc},
          {"mesh-floor-low-disc", mesh_floor_low_disc},
          {"room-lamp", room_lamp},
          {"room-lamp-crosses", room_lamp_crosses},
          {"disc-crosses-wall", disc_crosses_wall},
          {"disc-crosses-ball", disc_crosses_ball},
          {"disc-below-floor", disc_below_floor},
          {"lamp-on-ceiling", lamp_on_ceiling},
          {"lamp-on-floor", lamp_on_floor},
          {"lamp-on-wall", lamp_on_wall},
          {"slats", slats},
          {"slivers", slivers},
          {"grid-in-line", grid_in_line},
          {"huge-and-tiny", huge_and_tiny}};
}

}  // namespace penumbra::hunt
