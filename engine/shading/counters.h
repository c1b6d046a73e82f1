#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace penumbra::shading {

using Count = std::uint64_t;

/// Rays cast.
struct RayCounts {
  Count camera = 0, shadow = 0, reflection = 0, transmission = 0;
};

/// Rays cast and work proven unnecessary, by one thread.
struct Counters {
  RayCounts rays;
  Count area_samples_exact = 0;      // of area lights in full view: their diffuse light has a closed form
  Count camera_rays_bundled = 0;     // cast, but on the way of another ray
  Count hidden_spheres = 0;          // not looked at more closely: larger ones hide them
  Count lights_culled = 0;           // added nothing, as bounds over several of them tell
  Count lights_facing_away = 0;      // light and viewer on different sides
  Count lights_from_candidates = 0;  // told by the surfaces that may touch the light's cone
  Count lights_from_cells = 0;       // told by what neighbouring points share
  Count lights_from_drawn = 0;       // faint: others, drawn at random, stood for them
  Count lights_from_few_rays = 0;    // of few samples: nobody looked for what may hide them
  Count lights_from_neighbours = 0;  // of samples: those of points side by side told more of each
  Count lights_without_effect = 0;   // outside the spot, or no diffuse and no highlight
  Count negligible_rays = 0;         // secondary rays below min_contribution
  Count shadow_rays_agreed = 0;      // not cast: those of the points beside agreed
  Count shadow_rays_bundled = 0;     // cast, but on the way of another ray
  Count shadow_rays_covered = 0;     // not cast: what hides of the light was found from its occluders' outlines
  Count shadow_rays_dark = 0;        // not cast: one opaque surface covers the light's cone
  Count shadow_rays_listed = 0;      // tested against a short list instead of the structure
  Count shadow_rays_lit = 0;         // not cast: nothing can touch the light's cone
};

/// Each count with its name in a job's stats. `rays` and `counters` may be const. Structured bindings: a struct that
/// gets another member no longer compiles here.
template <class Rays>
auto by_name_of_ray(Rays& rays) {
  auto& [camera, shadow, reflection, transmission] = rays;
  using Named = std::pair<const char*, decltype(&camera)>;
  return std::array{Named{"camera", &camera}, Named{"shadow", &shadow}, Named{"reflection", &reflection},
                    Named{"transmission", &transmission}};
}
template <class Of>
auto by_name_of_work(Of& counters) {
  [[maybe_unused]] auto& [rays, exact, camera_bundled, spheres, culled, away, candidates, cells, drawn, few, neighbours,
                          without_effect, negligible, agreed, bundled, covered, dark, listed, lit] = counters;
  using Named = std::pair<const char*, decltype(&exact)>;
  return std::array{Named{"area_samples_exact", &exact},
                    Named{"camera_rays_bundled", &camera_bundled},
                    Named{"hidden_spheres", &spheres},
                    Named{"lights_culled", &culled},
                    Named{"lights_facing_away", &away},
                    Named{"lights_from_candidates", &candidates},
                    Named{"lights_from_cells", &cells},
                    Named{"lights_from_drawn", &drawn},
                    Named{"lights_from_few_rays", &few},
                    Named{"lights_from_neighbours", &neighbours},
                    Named{"lights_without_effect", &without_effect},
                    Named{"negligible_rays", &negligible},
                    Named{"shadow_rays_agreed", &agreed},
                    Named{"shadow_rays_bundled", &bundled},
                    Named{"shadow_rays_covered", &covered},
                    Named{"shadow_rays_dark", &dark},
                    Named{"shadow_rays_listed", &listed},
                    Named{"shadow_rays_lit", &lit}};
}

inline Counters& operator+=(Counters& sum, const Counters& more) {
  const auto add = [](const auto& into, const auto& from) {
    for (std::size_t i = 0; i < into.size(); ++i) *into[i].second += *from[i].second;
  };
  add(by_name_of_ray(sum.rays), by_name_of_ray(more.rays));
  add(by_name_of_work(sum), by_name_of_work(more));
  return sum;
}

}  // namespace penumbra::shading
