#include "engine/render/control.h"

#include <algorithm>

#include "engine/render/canvas.h"

namespace penumbra::render {

Control::Control() = default;
Control::~Control() = default;

double Control::percent() const {
  const std::uint64_t total = work_total_.load(std::memory_order_acquire);
  if (total == 0) return 0;
  const std::uint64_t done = std::min(work_done_.load(std::memory_order_relaxed), total);
  return 100.0 * static_cast<double>(done) / static_cast<double>(total);
}

Film Control::preview() const {
  is_watched_.store(true, std::memory_order_relaxed);
  std::shared_ptr<const Canvas> canvas;
  {
    const std::lock_guard lock(mutex_);
    canvas = canvas_;
  }
  return canvas ? canvas->done_tiles() : Film();
}

void Control::finish() { work_done_.store(work_total_.load(std::memory_order_relaxed), std::memory_order_relaxed); }

void Control::attach(std::shared_ptr<const Canvas> canvas, std::uint64_t work_total) {
  const std::lock_guard lock(mutex_);
  canvas_ = std::move(canvas);
  work_total_.store(work_total, std::memory_order_release);
}

}  // namespace penumbra::render
