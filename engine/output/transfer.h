#pragma once
#include <cstdint>
#include <vector>

#include "engine/render/film.h"
#include "engine/scene/options.h"

namespace penumbra::output {

/// Linear light of an sRGB value in [0, 1].
double linear_from_srgb(double encoded);

/// Every value of the film clamped to [0, 1], through the transfer curve, × 255 or × 65535, rounded to nearest.
std::vector<std::uint8_t> to_8_bit(const render::Film& film, scene::Transfer transfer);
std::vector<std::uint16_t> to_16_bit(const render::Film& film, scene::Transfer transfer);

}  // namespace penumbra::output
