#pragma once
#include <array>
#include <random>

#include "engine/scene/description.h"
#include "engine/scene/options.h"

namespace penumbra::test {

/// Section 2 of the contract, straight from its text: no tree, nothing shared with the engine but the description it
/// reads. Triangles and spheres; point, spot and directional lights; single pixels at their center.
class Oracle {
 public:
  Oracle(const scene::Description& scene, const scene::Options& options, int samples_per_light, unsigned long seed);
  /// Linear r, g, b.
  std::array<double, 3> pixel(int column, int row);

 private:
  struct Impl;
  const scene::Description& scene_;
  const scene::Options& options_;
  int samples_;
  std::mt19937_64 random_;
};

}  // namespace penumbra::test
