#pragma once
#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "engine/sampling/patterns.h"
#include "engine/shading/lights/light.h"

/// What rectangles and spheres share.
namespace penumbra::shading {

/// What a sample of an area light adds where nothing hides it, and how much of that gets through.
struct AreaSample {
  Color diffuse, highlight, transmittance = math::white;
};

/// Of the sample at `place` (relative to the point), which is seen in the unit `direction`; `radiance` is already
/// times its share of the light.
AreaSample lit_sample(const ShadingPoint& at, shadows::Sight& sight, shadows::Sight::Verdict verdict,
                      const Color& radiance, const Vec3& direction, const Vec3& place);

/// A sample of an area light that a point sees in the unit `direction`; the way to it ends a little in front of it.
struct AreaPlace {
  Vec3 direction, way;
  double solid_angle;  // that it stands for
};

/// Few samples of an area light, of points side by side: their rays in bundles, and what all of them tell of each.
class FewSamples {
 public:
  FewSamples(const BatchLighting& lighting, const LightName& name, const Color& radiance);
  static bool are_switched_on(const Switches& switches) { return switches.few_rays && switches.exact_area_lights; }
  /// Whether so few are asked for that they cost less than to look for what may hide a light of this radius: the wider
  /// it is, the more there is to find.
  static bool are_enough(const DiscSampling& sampling, double radius, double distance) {
    constexpr int few = 4, few_of_wide = 64;
    constexpr double wide = 0.2;
    return sampling.spiral.count() <= (radius > wide * distance ? few_of_wide : few);
  }
  /// A point: the projected solid angle of the light, not 0, whether all of it is above the horizon, and place(square),
  /// an AreaPlace.
  template <class Place>
  void add(std::size_t lane, double projected_solid_angle, bool is_above_horizon, const Place& place) {
    lanes_ |= LaneMask{1} << lane, projected_[lane] = projected_solid_angle;
    if (is_above_horizon) whole_ |= LaneMask{1} << lane;
    const sampling::Key key = key_of(lane);
    for (std::size_t round = 0; round < count_; ++round) set(round, lane, place(square(round, lane, key)));
  }
  /// Adds to the sums what is seen of the light.
  void add_visible();

 private:
  sampling::Key key_of(std::size_t lane) const;
  sampling::Point2 square(std::size_t round, std::size_t lane, const sampling::Key& key) const;
  void set(std::size_t round, std::size_t lane, const AreaPlace& place);

  const BatchLighting& lighting_;
  const LightName& name_;
  const Color& radiance_;
  std::size_t count_;  // of each point
  LaneMask lanes_ = 0, whole_ = 0;
  std::array<double, lane_count> projected_;
  std::vector<Lanes3> ways_;  // by round
  std::vector<double> weights_;
  std::vector<Color> highlights_;  // where nothing hides them
};

/// An area light that nothing hides: what is diffusely sent of it, and how large it is seen.
struct Unhidden {
  Color diffuse, radiance;
  double solid_angle;
};
/// What the point sends of an area light, told by outlines, lines across the light and their open parts: the share that
/// is seen of what is diffusely sent, and the highlight. Accounts for its variance. Nothing where outlines do not tell.
std::optional<Color> traced(const Lighting& lighting, shadows::Sight& sight, const shadows::SeenArea& area,
                            const Unhidden& unhidden, const sampling::Key& key);

/// What is diffusely sent of light that nothing hides, in closed form.
Color diffuse_of(const ShadingPoint& at, const Color& radiance, double projected_solid_angle);

/// The mean of an area light's samples; accounts for its variance. They are sample(i) with as many i, the next ones for
/// each camera sample of a pixel. `exact_diffuse()` is the diffuse part where nothing is hidden, if there is a closed
/// form – then times the share of it that the samples see.
Color averaged(const Lighting& lighting, std::uint32_t camera_sample,
               const std::function<AreaSample(std::uint32_t)>& sample,
               const std::function<std::optional<Color>()>& exact_diffuse);

}  // namespace penumbra::shading
