#pragma once
#include "engine/render/pixel_rays.h"
#include "engine/shading/integrator.h"

namespace penumbra::render {

/// The fewest shadow samples of 2, 4, 8 … that keep the error of a whole picture of one camera ray a pixel below
/// `target`, or `most` if none do: told by what squares of pixels here and there show of their error.
int samples_for_target(const PixelRays& rays, int width, int height, double target, int most,
                       shading::Integrator& integrator);

/// What lights that stand for others make of a picture of one camera ray a pixel, root mean square: told by what
/// squares of pixels here and there show.
double light_error_of(const PixelRays& rays, int width, int height, shading::Integrator& integrator);

}  // namespace penumbra::render
