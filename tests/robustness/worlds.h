#pragma once
#include <cstdlib>
#include <random>

#include "engine/accel/queries.h"
#include "engine/render/compile.h"
#include "engine/scene/description.h"

namespace penumbra::test {

using math::Vec3;

/// `full` when PENUMBRA_FULL=1 asks for the recipes' own counts, else `brief`.
inline int count(int brief, int full) {
  const char* wish = std::getenv("PENUMBRA_FULL");  // NOLINT(concurrency-mt-unsafe)
  return wish != nullptr && *wish == '1' ? full : brief;
}

inline constexpr scene::Acceleration accelerations[]{scene::Acceleration::none, scene::Acceleration::cbr,
                                                     scene::Acceleration::groups, scene::Acceleration::median,
                                                     scene::Acceleration::bvh};

inline shading::Scene compiled(const scene::Description& description,
                               scene::Acceleration acceleration = scene::Acceleration::bvh) {
  return render::compile(description, {acceleration, true, accel::run_in_turn}).scene;
}

inline scene::Description with_objects(std::vector<scene::Object> objects) {
  scene::Description description;
  description.materials.push_back(scene::default_material());
  description.objects = std::move(objects);
  return description;
}

class Random {
 public:
  explicit Random(unsigned long seed) : engine_(seed) {}
  double between(double low, double high) { return low + (high - low) * uniform_(engine_); }
  int below(int n) { return static_cast<int>(uniform_(engine_) * n); }
  Vec3 in_cube(double half) { return {between(-half, half), between(-half, half), between(-half, half)}; }
  Vec3 direction() {
    while (true) {
      const Vec3 v = in_cube(1);
      const double squared = math::dot(v, v);
      if (squared > 0.01 && squared < 1) return math::normalize(v);
    }
  }

 private:
  std::mt19937_64 engine_;
  std::uniform_real_distribution<double> uniform_;
};

}  // namespace penumbra::test
