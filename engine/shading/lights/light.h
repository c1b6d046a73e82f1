#pragma once
#include <array>
#include <functional>

#include "engine/math/color.h"
#include "engine/sampling/hash.h"
#include "engine/shading/counters.h"
#include "engine/shading/point_batch.h"
#include "engine/shading/scene.h"
#include "engine/shading/shading_point.h"
#include "engine/shading/shadows/shadows.h"
#include "engine/shading/switches.h"
#include "engine/shading/visibility.h"

/// The lights, one file a kind. To add one: a struct in shading/scene.h and a line in its variant, a lit_by here, a
/// file beside this one; the compiler names the rest.
namespace penumbra::shading {

/// What all lights at a point of a path share.
struct Lighting {
  const Scene& scene;
  const Switches& switches;
  const DiscSampling& sampling;  // of every soft light
  const std::function<bool()>& is_canceled;
  Counters& counters;
  shadows::Shadows& shadows;
  const ShadingPoint& at;
  const Color& weight;  // what share of the point's light arrives at the camera
  Variance& variance;   // of what arrives there, added up

  /// Counts a light that adds nothing, unless such work is to be done; true if no more is to be done about it.
  bool skip_if(bool adds_nothing, Count Counters::*counter) const;
  /// Counts the samples that were not needed.
  void skip_samples(Count Counters::*counter) const;
  /// `share` × the light through a visibility; accounts for its variance.
  Color visible(const Color& share, const Visibility& visibility) const;
};

/// A light of the scene: its index, and the place of its samples.
struct LightPlace {
  std::size_t index;
  sampling::Place samples;
};

/// What the point sends to the viewer of the light.
Color lit_by(const DiscLight& light, const Lighting& lighting, const LightPlace& place);
Color lit_by(const DistantLight& light, const Lighting& lighting, const LightPlace& place);
Color lit_by(const RectangleLight& light, const Lighting& lighting, const LightPlace& place);
Color lit_by(const SphereLight& light, const Lighting& lighting, const LightPlace& place);

/// What points side by side have found so far of the lights.
struct BatchSums {
  std::array<Color, lane_count> color{};
  std::array<Variance, lane_count> variance{};
  std::array<double, lane_count> light_error{};  // of any channel, from lights that stand for others
};

/// What all lights of points side by side share: camera rays met them, and all of their light arrives.
struct BatchLighting {
  const Scene& scene;
  const Switches& switches;
  const DiscSampling& sampling;
  const std::function<bool()>& is_canceled;
  Counters& counters;
  shadows::Shadows& shadows;
  const PointBatch& points;
  const sampling::Key* keys;  // by lane
  BatchSums& sums;

  /// Of one of the points.
  Lighting of(std::size_t lane) const {
    return {scene,   switches,           sampling,    is_canceled,        counters,
            shadows, points.point(lane), math::white, sums.variance[lane]};
  }
};

/// A light of the scene and the name of its samples.
struct LightName {
  std::size_t index;
  std::uint64_t samples;
};

/// Adds what each lit point sends to the viewer of the light. Point and spot lights, and distant ones, light all lanes
/// at once; area lights where they get few samples.
void light_batch(const DiscLight& light, const BatchLighting& lighting, const LightName& name);
void light_batch(const DistantLight& light, const BatchLighting& lighting, const LightName& name);
void light_batch(const RectangleLight& light, const BatchLighting& lighting, const LightName& name);
void light_batch(const SphereLight& light, const BatchLighting& lighting, const LightName& name);
/// One of the points after the other.
template <class Light>
void light_each(const Light& light, const BatchLighting& lighting, const LightName& name, LaneMask lanes) {
  for_each_lane(lanes, [&](std::size_t lane) {
    const LightPlace place{name.index, {lighting.keys[lane], name.samples}};
    lighting.sums.color[lane] += lit_by(light, lighting.of(lane), place);
  });
}

/// Light arriving from direction l reaches the viewer only when both are on one side of the surface.
inline bool is_on_viewers_side(const ShadingPoint& at, const Vec3& towards_light) {
  return math::dot(at.facing, towards_light) > 0;
}

/// The product, where 0 × anything is 0 – an overflowing light on a black surface stays black.
inline Color filtered(const Color& a, const Color& b) {
  // Of numbers, only infinity × 0 is none.
  const auto product = [](double x, double y) { return x * y == x * y ? x * y : 0; };
  return {product(a.r, b.r), product(a.g, b.g), product(a.b, b.b)};
}

}  // namespace penumbra::shading
