#pragma once
#include <array>
#include <functional>
#include <optional>

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

/// What is diffusely sent of light that nothing hides, in closed form.
Color diffuse_of(const ShadingPoint& at, const Color& radiance, double projected_solid_angle);

/// The mean of an area light's samples; accounts for its variance. They are sample(i) with as many i, the next ones for
/// each camera sample of a pixel. `exact_diffuse()` is the diffuse part where nothing is hidden, if there is a closed
/// form – then times the share of it that the samples see.
Color averaged(const Lighting& lighting, std::uint32_t camera_sample,
               const std::function<AreaSample(std::uint32_t)>& sample,
               const std::function<std::optional<Color>()>& exact_diffuse);

}  // namespace penumbra::shading
