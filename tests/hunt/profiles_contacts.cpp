// Things that touch, coincide, and cross each other.
#include "tests/hunt/maker.h"
#include "tests/hunt/optics.h"

namespace penumbra::hunt {
namespace {

void lamp_under_ball(Maker& m) {
  m.floor(m.matt());
  m.object(m.sphere({0, 1, 0}, 1), m.shiny());
  const Vec3 middle = m.point(1, 3.5, 4.5);
  const double radius = m.in(0.3, 0.8);
  m.object(m.sphere(middle, radius), m.matt());
  const Vec3 at = m.chance(0.5) ? Vec3{0, -1, 0} : m.direction();
  m.point_light(middle + at * radius, m.chance(0.6) ? 0 : m.in(0.1, 0.6));
}

void lamp_on_cylinder(Maker& m) {
  m.floor(m.matt());
  m.clutter(1);
  const double y = m.in(2, 4), radius = m.in(0.2, 0.6), x = m.in(-1, 1);
  if (m.chance(0.5))
    m.object(m.cylinder({x, y, -1}, {0, 0, 1}, radius, 2), m.matt());
  else
    m.object(m.tube({x, y, 0}, {0, 0, 1}, radius), m.matt());
  m.point_light({x, y - radius, m.in(-0.8, 0.8)}, m.chance(0.6) ? 0 : m.in(0.1, 0.5));
}

void lamp_at_corner(Maker& m) {
  m.floor(m.matt());
  m.clutter(1);
  const Vec3 low = m.point(1, 2, 3), high = low + Vec3{m.in(0.3, 1), m.in(0.3, 1), m.in(0.3, 1)};
  m.object(m.box(low, high), m.matt());
  const int which = m.below(3);
  m.point_light({which > 0 ? low.x : m.in(low.x, high.x), low.y, which > 1 ? high.z : m.in(low.z, high.z)},
                m.chance(0.6) ? 0 : m.in(0.1, 0.5));
}

void coplanar_panes(Maker& m) {
  m.floor(m.matt());
  const double y = m.in(0.5, 2);
  for (int i = 2 + m.below(2); i > 0; --i) {
    const Vec3 p = m.point(1, y, y);
    m.object(m.rectangle({p.x - 1, y, p.z - 1}, {2, 0, 0}, {0, 0, m.chance(0.5) ? 2.0 : 1.5}),
             m.chance(0.75) ? m.pane() : m.matt());
  }
  m.soft_light();
  if (m.chance(0.3)) m.point_light(m.point(3, 3, 5), 0);
}

void twins(Maker& m) {
  m.floor(m.matt());
  const double size = m.in(0.5, 1);
  const Vec3 at{m.in(-1, 1), size + m.in(0, 0.7), 0};
  const int which = m.below(4);
  for (int i = 0; i < 2; ++i) {
    const Json material = m.chance(0.6) ? m.pane() : m.chance(0.3) ? m.glass() : m.matt();
    if (which == 0) m.object(m.sphere(at, size), material);
    if (which == 1) m.object(m.box(at - Vec3{size, size, size}, at + Vec3{size, 0.3, size}), material);
    if (which == 2) m.object(m.triangle(at - Vec3{1, 0, 0}, at + Vec3{1, 0, 0.4}, at + Vec3{0, 1, 0}), material);
    if (which == 3) m.object(m.cylinder(at - Vec3{0, size, 0}, {0, 1, 0}, size, 1), material);
  }
  m.soft_light();
}

void decal(Maker& m) {
  // A pane or a matt piece in the floor's own plane, before or after it in the list.
  const bool first = m.chance(0.5);
  const Json on = m.chance(0.6) ? m.pane() : m.matt();
  const Json piece =
      m.chance(0.5) ? m.rectangle({-1, 0, 1}, {m.in(1, 2), 0, 0}, {0, 0, -1.5}) : m.star({0, 0, 0}, {0, 1, 0}, 1.5, 5);
  if (first) m.object(piece, on);
  m.floor(m.chance(0.8) ? m.matt() : m.pane());
  if (!first) m.object(piece, on);
  m.clutter(1);
  if (m.chance(0.5))
    m.soft_light();
  else
    m.point_light(m.point(2, 0.2, 1.5), m.in(0.5, 2));
}

void glass_on_table(Maker& m) {
  const double y = m.chance(0.5) ? 0 : m.in(0.2, 1);
  m.object(m.rectangle({-4, y, 4}, {8, 0, 0}, {0, 0, -8}), m.matt());
  for (int i = 1 + m.below(2); i >= 0; --i) {
    const Vec3 at = m.point(1.5, y, y);
    const Json material = m.chance(0.7) ? m.pane() : m.glass();
    switch (m.below(4)) {
      case 0:
        m.object(m.cylinder(at, {0, 1, 0}, m.in(0.3, 0.6), m.in(0.4, 1.2)), material);
        break;
      case 1:
        m.object(m.box(at, at + Vec3{m.in(0.4, 1), m.in(0.4, 1), m.in(0.4, 1)}), material);
        break;
      case 2:
        m.object(m.sphere(at + Vec3{0, 0.5, 0}, 0.5), material);
        break;
      default:
        m.object(m.cylinder(at + Vec3{0, 1, 0}, {0, -1, 0}, m.in(0.3, 0.6), 1), material);
    }
  }
  m.soft_light();
}

void stacked_boxes(Maker& m) {
  m.floor(m.matt());
  double y = 0;
  for (int i = 2 + m.below(3); i > 0; --i) {
    const double h = m.in(0.2, 0.8), w = m.in(0.4, 1.2), x = m.in(-0.4, 0.4);
    m.object(m.box({x - w, y, x - w}, {x + w, y + h, x + w}), m.chance(0.7) ? m.matt() : m.pane());
    y += h;
  }
  m.soft_light();
}

void touching_balls(Maker& m) {
  m.floor(m.matt());
  const double a = m.in(0.4, 1), b = m.in(0.4, 1);
  const Vec3 p{-0.5, a, 0};
  m.object(m.sphere(p, a), m.any_material());
  m.object(m.sphere(p + m.direction() * (a + b), b), m.any_material());
  m.object(m.cylinder({m.in(1, 2), 0, 0}, {0, 1, 0}, 0.4, 1), m.any_material());
  m.soft_light();
}

void crossing_flats(Maker& m) {
  m.floor(m.matt());
  for (int i = 2 + m.below(4); i > 0; --i) {
    const Vec3 at = m.point(1.2, 0, 1), u = m.direction(), v = math::normalize(math::cross(u, m.direction()));
    m.object(m.rectangle(at - u * 0.8 - v * 0.8, u * 1.6, v * 1.6), m.chance(0.7) ? m.matt() : m.pane());
  }
  m.soft_light();
}

void through_the_point(Maker& m) {
  // Walls that stand on what is lit, and go on below it.
  m.object(m.rectangle({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}), m.matt());
  for (int i = 1 + m.below(4); i > 0; --i) {
    const Vec3 p = m.point(2, 0, 0), u{m.in(-1, 1), 0, m.in(-1, 1)};
    m.object(m.rectangle(p - Vec3{0, m.chance(0.5) ? 0.5 : 0.0, 0}, u, {m.in(-0.3, 0.3), m.in(0.5, 2), 0}),
             m.chance(0.7) ? m.matt() : m.pane());
  }
  m.point_light(m.point(2.5, 0.2, 2), m.in(0.3, 1.5));
}

void overlapping_solids(Maker& m) {
  m.floor(m.matt());
  for (int i = 0; i < 4; ++i) {
    const Vec3 at = m.point(0.7, 0.3, 1);
    if (m.chance(0.5))
      m.object(m.sphere(at, m.in(0.3, 0.8)), m.chance(0.6) ? m.matt() : m.pane());
    else
      m.object(m.cylinder(at, m.direction(), m.in(0.2, 0.5), m.in(0.5, 1.5)), m.chance(0.6) ? m.matt() : m.pane());
  }
  m.soft_light();
}

void planes(Maker& m) {
  m.object(m.plane({0, 0, 0}, {0, 1, 0}), m.matt());
  for (int i = 1 + m.below(3); i > 0; --i) {
    const Vec3 n = m.direction();
    m.object(m.plane(n * -m.in(3, 6), n), m.chance(0.8) ? m.matt() : m.pane());
  }
  m.camera({0.3, 1.5, 2}, m.point(1, 0.3, 1), 60);
  m.clutter(1);
  m.point_light(m.point(1.5, 0.7, 2), m.in(0.1, 1));
}

}  // namespace

std::vector<Profile> contact_profiles() {
  return {{"lamp-under-ball", lamp_under_ball},
          {"lamp-on-cylinder", lamp_on_cylinder},
          {"lamp-at-corner", lamp_at_corner},
          {"coplanar-panes", coplanar_panes},
          {"twins", twins},
          {"decal", decal},
          {"glass-on-table", glass_on_table},
          {"stacked-boxes", stacked_boxes},
          {"touching-balls", touching_balls},
          {"crossing-flats", crossing_flats},
          {"through-the-point", through_the_point},
          {"overlapping-solids", overlapping_solids},
          {"planes", planes}};
}

}  // namespace penumbra::hunt
