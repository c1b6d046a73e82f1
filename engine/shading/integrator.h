#pragma once
#include <functional>
#include <optional>
#include <span>

#include "engine/sampling/hash.h"
#include "engine/shading/light_tree.h"
#include "engine/shading/lights/light.h"
#include "engine/shading/point_batch.h"
#include "engine/shading/scene.h"
#include "engine/shading/shadows/shadows.h"

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
  double light_error = 0;  // what drawn lights may make of any channel of a camera ray's light, root mean square
};

/// What a camera ray sees: section 2 of the contract, evaluated recursively. One per thread.
class Integrator {
 public:
  /// `is_canceled` is asked at every surface and between many samples; once true, rays return black at once. All
  /// arguments outlive this object.
  Integrator(const Scene& scene, const IntegratorSettings& settings, const std::function<bool()>& is_canceled);

  struct Sample {
    Color radiance;
    Variance variance;       // of `radiance`, from the soft lights' samples
    double light_error = 0;  // of any channel of `radiance`, from lights that stand for others: root mean square
  };
  /// `ray.direction` is unit; `key` names the camera sample; every soft light gets `sampling`.
  Sample trace(const geometry::Ray& ray, const DiscSampling& sampling, const sampling::Key& key);
  /// A camera ray, and what names the camera sample.
  struct CameraRay {
    geometry::Ray ray;
    sampling::Key key;
    PixelPlace pixel;
  };
  /// The same for up to lane_count of them, lit together.
  void trace(std::span<const CameraRay> rays, const DiscSampling& sampling, Sample* samples);

  const Counters& counters() const { return counters_; }

 private:
  /// Where on a path a ray starts: how many surfaces and how far from the camera, what share of its light arrives, and
  /// what error of it lights that stand for others may make.
  struct Path {
    int depth = 0;
    double distance = 0;
    Color weight = math::white;
    double light_error = 0;
  };
  Color radiance(const geometry::Ray& ray, const std::optional<accel::Hit>& hit, const Path& path,
                 const sampling::Key& key);
  /// Where a ray that has come `distance` before it starts meets a surface.
  ShadingPoint point(const Vec3& direction, const accel::Hit& hit, const geometry::SurfacePoint& surface,
                     double distance) const;
  /// What some camera rays meet. Returns which meet something, one bit each.
  unsigned meet(const accel::Bundle& rays, accel::Hit* hits, geometry::SurfacePoint* surfaces);
  Color direct(const ShadingPoint& at, const Path& path, const sampling::Key& key);
  /// What the surface sends out by itself, or of the ambient light.
  Color unlit(const ShadingPoint& at, const Path& path) const;
  Color secondary(const ShadingPoint& at, const Path& path, const sampling::Key& key);
  void light_together(const PointBatch& points, const sampling::Key* keys, BatchSums& sums);
  /// The part of the path's error that is the point's own: the rest is for what it reflects and transmits.
  double own_error(const CompiledMaterial& material, const Path& path) const;
  /// Chooses the lights for points, so many, that `region()` is around.
  template <class Region>
  void choose_lights(const Region& region, std::size_t points, double error, const sampling::Key& key);
  /// Calls use(light, index) for each that was chosen for itself; false once it is canceled.
  template <class Use>
  bool each_light(const Use& use);
  /// Calls use(light, index, times) for those that stand for others, which are that many times what they are.
  template <class Use>
  bool each_drawn_light(const Use& use);

  const Scene& scene_;
  IntegratorSettings settings_;
  const std::function<bool()>& is_canceled_;
  const DiscSampling* sampling_ = nullptr;  // of the sample being traced
  Counters counters_;
  shadows::Shadows shadows_;
  LightChoice lights_;
  Variance variance_;
  double light_error_ = 0;
};

}  // namespace penumbra::shading
