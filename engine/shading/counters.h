#pragma once
#include <cstdint>

namespace penumbra::shading {

/// Rays cast and work proven unnecessary, by one thread.
struct Counters {
  std::uint64_t camera = 0, shadow = 0, reflection = 0, transmission = 0;
  std::uint64_t camera_rays_bundled = 0;    // cast, but on the way of another ray
  std::uint64_t lights_facing_away = 0;     // light and viewer on different sides
  std::uint64_t lights_without_effect = 0;  // outside the spot, or no diffuse and no highlight
  std::uint64_t shadow_rays_lit = 0;        // not cast: nothing can touch the light's cone
  std::uint64_t shadow_rays_dark = 0;       // not cast: one opaque surface covers the light's cone
  std::uint64_t shadow_rays_listed = 0;     // tested against a short list instead of the structure
  std::uint64_t shadow_rays_covered = 0;    // not cast: what hides of the light was found from its occluders\' outlines
  std::uint64_t shadow_rays_bundled = 0;    // likewise
  std::uint64_t hidden_spheres = 0;         // not looked at more closely: larger ones hide them
  std::uint64_t area_samples_exact = 0;     // of area lights in full view: their diffuse light has a closed form
  std::uint64_t negligible_rays = 0;        // secondary rays below min_contribution

  Counters& operator+=(const Counters& other) {
    camera += other.camera, shadow += other.shadow, reflection += other.reflection, transmission += other.transmission;
    camera_rays_bundled += other.camera_rays_bundled;
    lights_facing_away += other.lights_facing_away, lights_without_effect += other.lights_without_effect;
    shadow_rays_lit += other.shadow_rays_lit, shadow_rays_dark += other.shadow_rays_dark;
    shadow_rays_listed += other.shadow_rays_listed, shadow_rays_covered += other.shadow_rays_covered;
    shadow_rays_bundled += other.shadow_rays_bundled, hidden_spheres += other.hidden_spheres;
    area_samples_exact += other.area_samples_exact, negligible_rays += other.negligible_rays;
    return *this;
  }
};

}  // namespace penumbra::shading
