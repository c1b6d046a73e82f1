#pragma once
#include "engine/render/film.h"

namespace penumbra::output {

/// The film in small: `longest` pixels at the longer edge, or as it is where that is no less. Every pixel is the mean,
/// in linear light clamped to [0, 1], of the area it stands for.
render::Film thumbnail(const render::Film& film, int longest);

}  // namespace penumbra::output
