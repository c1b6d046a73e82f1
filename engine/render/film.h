#pragma once
#include <cstddef>
#include <vector>

#include "engine/render/large_pages.h"

namespace penumbra::render {

/// A linear-light image, unclamped: row-major, top row first, three floats (r, g, b) a pixel.
struct Film {
  using Values = std::vector<float, LargePages<float>>;

  int width = 0, height = 0;
  Values rgb;

  Film() = default;
  Film(int w, int h) : width(w), height(h), rgb(3 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  std::size_t offset(int column, int row) const {
    return 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column));
  }
};

}  // namespace penumbra::render
