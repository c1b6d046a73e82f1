#pragma once
#include "engine/accel/world.h"
#include "engine/geometry/quadrics.h"
#include "engine/shading/shadows/disc_cover.h"

namespace penumbra::shading::shadows {

/// Whether some segment from view.from to the disc meets the convex hull of a sphere, tube or cylinder – exactly but
/// for rounding, and so the same whatever structure found the item: only what is met may decide how a shadow is told.
/// Gilbert, Johnson, Keerthi, "A Fast Procedure for Computing the Distance Between Complex Objects in Three-Dimensional
/// Space", IEEE Journal of Robotics and Automation 4(2), 1988.
bool meets_segments(const DiscView& view, const accel::World& world, const accel::Item& item);

}  // namespace penumbra::shading::shadows
