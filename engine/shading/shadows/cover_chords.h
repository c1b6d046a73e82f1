#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/shading/shadows/disc_cover.h"

namespace penumbra::shading::shadows {

/// Parallel chords of a disc, in lanes: what is left of each runs from `begin` to `end` along it. `count` is a
/// multiple of 4, filled up with chords that are empty (begin = end).
struct ChordLanes {
  const double *offset, *begin, *end;
  std::size_t count;
};

/// What a cover hides of chords.
struct HiddenLanes {
  double *begin, *end;
  std::uint8_t* hits;  // a bit a chord, eight a byte: whether begin < end, or nothing is hidden
};

/// Where each chord is inside all of a cover's edges and, unless there is none, inside its ellipse – a quadratic with
/// f < 0. Both are turned to the chords' frame.
void clip_to_cover(std::span<const Linear> edges, const Quadratic* ellipse, const ChordLanes& chords,
                   const HiddenLanes& hidden);

}  // namespace penumbra::shading::shadows
