#pragma once
#include "engine/render/film.h"
#include "tests/bench/embree_scene.h"

namespace penumbra::bench {

struct BruteForceSettings {
  int width = 800, height = 800;
  int shadow_samples = 16;  // a square number
  int packet_width = 16;    // 1, 8 or 16 shadow rays at a time
  int threads = 1;
  std::uint64_t seed = 0;
};

/// The contract's image by brute force: a jittered grid of shadow rays for every (hit, light).
render::Film brute_force(const scene::Description& description, const FlatScene& flat, const EmbreeScene& embree,
                         const BruteForceSettings& settings);

}  // namespace penumbra::bench
