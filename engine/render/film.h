#pragma once
#include <cstddef>
#include <vector>

#include "engine/system/large_pages.h"

namespace penumbra::render {

/// A linear-light image, unclamped: row-major, top row first, three floats (r, g, b) a pixel.
struct Film {
  using Values = std::vector<float, system::LargePages<float>>;

  int width = 0, height = 0;
  Values rgb;

  Film() = default;
  Film(int w, int h) : width(w), height(h), rgb(size_of(w, h), 0) {}
  /// Of which every value is to be written: what they are until then is left open.
  static Film unwritten(int w, int h) {
    Film film;
    film.width = w, film.height = h, film.rgb = Values(size_of(w, h));
    return film;
  }
  std::size_t offset(int column, int row) const {
    return 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column));
  }

 private:
  static std::size_t size_of(int w, int h) { return 3 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h); }
};

}  // namespace penumbra::render
