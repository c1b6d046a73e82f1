#pragma once
#include <array>
#include <functional>

#include "engine/math/color.h"
#include "engine/sampling/hash.h"
#include "engine/shading/counters.h"
#include "engine/shading/scene.h"
#include "engine/shading/shading_point.h"
#include "engine/shading/shadows/shadows.h"
#include "engine/shading/switches.h"
#include "engine/shading/visibility.h"

/// The lights, one file a kind. To add one: a struct in shading/scene.h and a line in its variant, a lit_by here, a
/// file beside this one; the compiler names the rest.
namespace penumbra::shading {

class Together;

/// What all lights at a point of a path share.
struct Lighting {
  const Scene& scene;
  const Switches& switches;
  const DiscSampling& sampling;  // of every soft light
  const std::function<bool()>& is_canceled;
  Counters& counters;
  shadows::Shadows& shadows;
  const ShadingPoint& at;
  const Color& weight;           // what share of the point's light arrives at the camera
  Variance& variance;            // of what arrives there, added up
  Together* together = nullptr;  // points side by side that are lit together
  Color* sum = nullptr;          // what that adds to
  std::size_t place = 0;         // of the point among those

  /// Counts a light that adds nothing, unless such work is to be done; true if no more is to be done about it.
  bool skip_if(bool adds_nothing, Count Counters::*counter) const;
  /// Counts the samples that were not needed.
  void skip_samples(Count Counters::*counter) const;
  /// `share` × the light through a visibility; accounts for its variance.
  Color visible(const Color& share, const Visibility& visibility) const;
  /// `share` × what is seen of a disc; black if it is added later, by `together`.
  Color through(const Color& share, shadows::Sight sight, const shadows::SeenDisc& disc,
                const sampling::Place& samples) const;
};

/// Soft lights of points side by side that wait for their samples, to take them together; one light at a time.
class Together {
 public:
  explicit Together(shadows::Shadows& shadows) : shadows_(shadows) {}
  /// `share` × what is seen of the disc, to be added to the lighting's sum. bundle_width of them at most.
  void add(const shadows::SampledDisc& disc, const Color& share, const Lighting& lighting);
  /// A point sees all of the light for certain, or nothing of it.
  void note(bool is_lit) { ++(is_lit ? votes_.lit : votes_.dark); }
  /// Adds all of them to their sums. `name` is of these points and this light.
  void finish(const DiscSampling& sampling, std::uint64_t name);

 private:
  struct Waiting {
    Color share;
    const Lighting* lighting;
  };
  shadows::Shadows& shadows_;
  shadows::Votes votes_;
  std::size_t count_ = 0;
  std::array<shadows::SampledDisc, accel::bundle_width> discs_;
  std::array<Waiting, accel::bundle_width> waiting_;
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

/// Light arriving from direction l reaches the viewer only when both are on one side of the surface.
inline bool is_on_viewers_side(const ShadingPoint& at, const Vec3& towards_light) {
  return math::dot(at.facing, towards_light) > 0;
}

/// The product, where 0 × anything is 0 – an overflowing light on a black surface stays black.
inline Color filtered(const Color& a, const Color& b) {
  const auto product = [](double x, double y) { return x == 0 || y == 0 ? 0 : x * y; };
  return {product(a.r, b.r), product(a.g, b.g), product(a.b, b.b)};
}

}  // namespace penumbra::shading
