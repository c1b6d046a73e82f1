// Cameras, several samples a pixel, and pictures large enough to tell how large their error is.
#include "tests/hunt/maker.h"

namespace penumbra::hunt {
namespace {

void things(Maker& m) {
  m.floor(m.matt());
  m.clutter(2);
  m.soft_light();
}

void add_lens(Maker& m) {
  m.camera_anywhere();
  m.scene["camera"]["lens"] = {{"aperture_radius", m.random.wide(0.02, 0.5)}, {"focus_distance", m.in(3, 10)}};
}

void lens(Maker& m) {
  things(m), add_lens(m);
  if (m.chance(0.5)) m.options["samples_per_pixel"] = 2 + m.below(6);
}

void pixel_samples(Maker& m) {
  things(m);
  m.options["samples_per_pixel"] = 2 + m.below(8);
}

void orthographic(Maker& m) {
  things(m);
  m.scene["camera"] = {{"position", {m.in(-1, 1), m.in(2, 5), m.in(4, 7)}},
                       {"look_at", {0, 0.5, 0}},
                       {"projection", "orthographic"},
                       {"view_plane", {{"width", m.in(3, 6)}, {"height", m.in(2, 4)}}}};
}

void orthographic_lens(Maker& m) {
  orthographic(m);
  m.scene["camera"]["lens"] = {{"aperture_radius", m.random.wide(0.02, 0.3)}, {"focus_distance", m.in(3, 10)}};
}

void view_plane(Maker& m) {
  things(m), m.camera_anywhere();
  m.scene["camera"].erase("vertical_fov");
  m.scene["camera"]["view_plane"] = {
      {"width", m.in(0.5, 1.5)}, {"height", m.in(0.5, 1.5)}, {"distance", m.in(0.7, 1.5)}};
  m.scene["camera"]["up"] = Maker::json({m.in(-1, 1), 1, m.in(-0.3, 0.3)});
}

void near_ground(Maker& m) {
  things(m);
  m.camera({m.in(-1, 1), m.random.wide(0.01, 0.3), 4}, {0, m.in(0, 0.5), 0}, 40);
}

/// Larger, with few samples: there must be an error to be told.
void large(Maker& m) {
  m.size(36, 27);
  m.options["shadow_samples"] = m.chance(0.5) ? 4 : 16;
}

void estimate_discs(Maker& m) { things(m), large(m); }

void estimate_area(Maker& m) {
  m.floor(m.matt());
  m.clutter(3);
  m.chance(0.5) ? m.lamp(m.point(2, 2, 4), m.in(0.5, 1.5), 3) : m.panel({-1, 3, -1}, {2, 0, 0}, {0, 0, 2}, 2);
  large(m);
}

void estimate_pixels(Maker& m) {
  things(m), large(m);
  m.options["samples_per_pixel"] = 2 + m.below(14);
}

void estimate_lens(Maker& m) {
  things(m), add_lens(m), large(m);
  m.options["samples_per_pixel"] = 1 + m.below(16);
}

void target(Maker& m) {
  things(m), large(m);
  m.options["shadow_samples"] = 1024;
  m.options["target_error"] = m.random.wide(0.003, 0.05);
}

void target_lens(Maker& m) {
  things(m), large(m);
  if (m.chance(0.6)) add_lens(m);
  m.options["samples_per_pixel"] = 1024;
  m.options["shadow_samples"] = m.chance(0.5) ? 8 : 64;
  m.options["target_error"] = m.random.wide(0.003, 0.05);
}

}  // namespace

std::vector<Profile> camera_profiles() {
  return {{"lens", lens},
          {"pixel-samples", pixel_samples},
          {"orthographic", orthographic},
          {"orthographic-lens", orthographic_lens},
          {"view-plane", view_plane},
          {"near-ground", near_ground},
          {"estimate-discs", estimate_discs},
          {"estimate-area", estimate_area},
          {"estimate-pixels", estimate_pixels},
          {"estimate-lens", estimate_lens},
          {"target", target},
          {"target-lens", target_lens}};
}

}  // namespace penumbra::hunt
