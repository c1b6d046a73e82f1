#pragma once
#include "engine/shading/point_batch.h"
#include "engine/shading/visibility.h"

namespace penumbra::shading::shadows {

/// What points side by side see of a light by samples varies little along a surface: gives each lane the best guess
/// from its own mean and the plane through those of all on one surface. Returns to how many. The samples of all lanes
/// together may be one pattern.
std::size_t share_samples(const PointBatch& points, LaneMask lanes, bool is_one_pattern, Visibility* seen);

}  // namespace penumbra::shading::shadows
