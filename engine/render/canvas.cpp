#include "engine/render/canvas.h"

namespace penumbra::render {

Film Canvas::done_tiles() const {
  Film copy = backdrop_ ? backdrop_->done_tiles() : Film(film_.width, film_.height);
  for (int i = 0; i < tile_count(); ++i) {
    if (!is_done_[static_cast<std::size_t>(i)].load(std::memory_order_acquire)) continue;
    const Tile t = tile(i);
    for (int row = t.top; row < t.bottom; ++row) {
      const auto from = static_cast<std::ptrdiff_t>(film_.offset(t.left, row));
      std::copy_n(film_.rgb.begin() + from, 3 * (t.right - t.left), copy.rgb.begin() + from);
    }
  }
  return copy;
}

}  // namespace penumbra::render
