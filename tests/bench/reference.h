#pragma once
#include <string>

#include "engine/render/film.h"
#include "tests/bench/flat_scene.h"

namespace penumbra::bench {

struct ReferenceSettings {
  int width = 800, height = 800;
  int samples = 2048;          // of each half
  int scouting_samples = 256;  // where all of these agree in a pixel and its neighbourhood, they are enough
  int probing_samples = 512;   // elsewhere, where all of these agree for one (hit, light), they are enough
  int threads = 1;
};

/// The mean of two independent images A and B. `squared_error` ≈ mean (A − B)²/4 is what it adds to a measured error.
struct Reference {
  render::Film film;
  double squared_error = 0;
};

/// The contract's image of a scene, without Penumbra's code paths: exact hits in double, shadow rays with Embree in
/// robust mode, Sobol' points with a random digital shift. Kept in the file `cache` once made.
Reference reference_image(const scene::Description& description, const FlatScene& flat,
                          const ReferenceSettings& settings, const std::string& cache);

}  // namespace penumbra::bench
