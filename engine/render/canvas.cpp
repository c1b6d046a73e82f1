#include "engine/render/canvas.h"

namespace penumbra::render {

Film Canvas::done_tiles() const {
  Film copy = backdrop_ ? *backdrop_ : Film(film_->width, film_->height);
  for (int i = 0; i < tile_count(); ++i) {
    if (!is_done_[static_cast<std::size_t>(i)].load(std::memory_order_acquire)) continue;
    const Tile t = tile(i);
    for (int row = t.top; row < t.bottom; ++row) {
      const auto from = static_cast<std::ptrdiff_t>(film_->offset(t.left, row));
      std::copy_n(film_->rgb.begin() + from, 3 * (t.right - t.left), copy.rgb.begin() + from);
    }
  }
  return copy;
}

std::shared_ptr<const Film> Canvas::film() const {
  const bool is_whole = std::all_of(is_done_.get(), is_done_.get() + tile_count(),
                                    [](const auto& is_done) { return is_done.load(std::memory_order_acquire); });
  return is_whole ? film_ : std::make_shared<const Film>(done_tiles());
}

}  // namespace penumbra::render
