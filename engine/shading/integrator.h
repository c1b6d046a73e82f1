#pragma once
#include <functional>
#include <optional>
#include <span>

#include "engine/sampling/hash.h"
#include "engine/sampling/patterns.h"
#include "engine/shading/scene.h"
#include "engine/shading/shadows.h"

namespace penumbra::shading {

/// How wide a pixel is, in units of the scene, after a way of `distance`: at_camera + per_distance·distance.
struct PixelWidth {
  double at_camera = 0, per_distance = 0;
};

struct IntegratorSettings {
  int max_depth = 10;
  double min_contribution = 0.001;
  PixelWidth pixel_width;
  Switches switches;
};

/// What a camera ray sees: section 2 of the contract, evaluated recursively. One per thread.
class Integrator {
 public:
  /// `is_canceled` is asked at every surface and between many samples; once true, rays return black at once. All
  /// arguments outlive this object.
  Integrator(const Scene& scene, const IntegratorSettings& settings, const std::function<bool()>& is_canceled);

  struct Sample {
    Color radiance;
    Variance variance;  // of `radiance`, from the soft lights' samples
  };
  /// `ray.direction` is unit; `key` names the camera sample; every soft light gets `sampling`.
  Sample trace(const geometry::Ray& ray, const DiscSampling& sampling, const sampling::Key& key);
  /// The same where it is known what the ray meets.
  Sample trace(const geometry::Ray& ray, const std::optional<accel::Hit>& hit, const DiscSampling& sampling,
               const sampling::Key& key);
  /// What up to accel::bundle_width camera rays at once meet, with a place for each to find.
  void camera_hits(std::span<const geometry::PreparedRay> rays, std::optional<accel::Hit>* hits);

  const Counters& counters() const { return counters_; }

 private:
  /// Where on a path a ray starts: how many surfaces and how far from the camera, and what share of its light arrives.
  struct Path {
    int depth = 0;
    double distance = 0;
    Color weight = math::white;
  };
  /// A light of the scene: its index, and the place of its samples.
  struct LightPlace {
    std::size_t index;
    sampling::Place samples;
  };
  Color radiance(const geometry::Ray& ray, const std::optional<accel::Hit>& hit, const Path& path,
                 const sampling::Key& key);
  Color direct(const ShadingPoint& at, const Color& weight, const sampling::Key& key);
  Color lit_by(const DiscLight& light, const ShadingPoint& at, const Color& weight, const LightPlace& place);
  Color lit_by(const DistantLight& light, const ShadingPoint& at, const Color& weight, const LightPlace& place);
  Color lit_by(const RectangleLight& light, const ShadingPoint& at, const Color& weight, const LightPlace& place);
  Color lit_by(const SphereLight& light, const ShadingPoint& at, const Color& weight, const LightPlace& place);
  Color secondary(const ShadingPoint& at, const Path& path, const sampling::Key& key);
  /// Counts a light that adds nothing; true if no more is to be done about it.
  bool is_skipped(bool adds_nothing, std::uint64_t& counter);
  /// `share` × the light through a visibility; accounts for its variance.
  Color visible(const Color& share, const Visibility& visibility, const Color& weight);
  /// What a sample of an area light adds where nothing hides it, and how much of that gets through.
  struct AreaSample {
    Color diffuse, highlight, transmittance = math::white;
  };
  /// Of the sample at `place` (relative to the point), which is seen in the unit `direction`; `radiance` is already
  /// times its share of the light.
  AreaSample lit_sample(const ShadingPoint& at, const Color& radiance, const Vec3& direction, const Vec3& place,
                        Shadows::Verdict verdict);
  /// The mean of an area light's samples; accounts for its variance. The light is known to be lit wholly if `is_lit`;
  /// `exact_diffuse()` is the diffuse part when it is, if there is a closed form.
  template <class SampleFunction, class ExactDiffuse>
  Color averaged_area_light(const SampleFunction& sample, const Color& weight, bool is_lit,
                            const ExactDiffuse& exact_diffuse);
  void skip_samples(std::uint64_t& counter) const;

  const Scene& scene_;
  IntegratorSettings settings_;
  const std::function<bool()>& is_canceled_;
  const DiscSampling* sampling_ = nullptr;  // of the sample being traced
  Counters counters_;
  Shadows shadows_;
  Variance variance_;
};

}  // namespace penumbra::shading
