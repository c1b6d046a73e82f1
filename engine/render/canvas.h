#pragma once
#include <algorithm>
#include <atomic>
#include <memory>

#include "engine/math/color.h"
#include "engine/render/film.h"

namespace penumbra::render {

/// The film while it is being painted, in square tiles numbered row by row. A tile may be written by one thread; once
/// it is marked done any thread may read it.
class Canvas {
 public:
  static constexpr int tile_edge = 32;  // pixels

  struct Tile {
    int left, top, right, bottom;  // pixels, right and bottom exclusive
  };

  /// Every color that is set counts `gain` times. `backdrop`, if any, shows where no tile is done yet; it must be as
  /// large.
  Canvas(int width, int height, double gain = 1, std::shared_ptr<const Film> backdrop = nullptr)
      : gain_(gain),
        film_(std::make_shared<Film>(Film::unwritten(width, height))),
        backdrop_(std::move(backdrop)),
        columns_((width + tile_edge - 1) / tile_edge),
        rows_((height + tile_edge - 1) / tile_edge),
        is_done_(std::make_unique<std::atomic<bool>[]>(static_cast<std::size_t>(tile_count()))) {}

  int tile_count() const { return columns_ * rows_; }
  Tile tile(int index) const {
    const int left = index % columns_ * tile_edge, top = index / columns_ * tile_edge;
    return {left, top, std::min(left + tile_edge, film_->width), std::min(top + tile_edge, film_->height)};
  }
  void set(int column, int row, const math::Color& color) {
    float* rgb = film_->rgb.data() + film_->offset(column, row);
    const math::Color exposed = color * gain_;
    rgb[0] = static_cast<float>(exposed.r), rgb[1] = static_cast<float>(exposed.g),
    rgb[2] = static_cast<float>(exposed.b);
  }
  void mark_done(int index) { is_done_[static_cast<std::size_t>(index)].store(true, std::memory_order_release); }

  /// A copy of the tiles that are done; the rest is the backdrop's, or black.
  Film done_tiles() const;
  /// The same, without a copy once all tiles are done: nothing is written any more.
  std::shared_ptr<const Film> film() const;

 private:
  double gain_;
  std::shared_ptr<Film> film_;
  std::shared_ptr<const Film> backdrop_;
  int columns_, rows_;
  std::unique_ptr<std::atomic<bool>[]> is_done_;
};

}  // namespace penumbra::render
