#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>

#include "engine/render/film.h"

namespace penumbra::render {

class Canvas;

/// The line between a running render and those who watch it: progress and previews come out, a cancel goes in.
/// Every member may be called from any thread.
class Control {
 public:
  Control();
  ~Control();

  void cancel() { canceled_.store(true, std::memory_order_relaxed); }
  bool is_canceled() const { return canceled_.load(std::memory_order_relaxed); }

  /// 0 to 100, never falls. Reaches 100 when every pixel is rendered.
  double percent() const;

  /// The finished tiles so far; elsewhere what a coarse pass has shown, or black. An empty film (width 0) before the
  /// first tile starts.
  Film preview() const;
  /// Somebody has asked for a preview.
  bool is_watched() const { return is_watched_.load(std::memory_order_relaxed); }

  /// For `render`: the canvas being painted from now on, and the work that will be counted in all.
  void attach(std::shared_ptr<const Canvas> canvas, std::uint64_t work_total);
  /// For `render`: nothing is left to do, however much was announced.
  void finish();
  /// For `render`: `work` more units are done.
  void advance(std::uint64_t work) { work_done_.fetch_add(work, std::memory_order_relaxed); }

 private:
  std::atomic<bool> canceled_{false};
  mutable std::atomic<bool> is_watched_{false};
  std::atomic<std::uint64_t> work_done_{0}, work_total_{0};
  mutable std::mutex mutex_;
  std::shared_ptr<const Canvas> canvas_;  // guarded by mutex_
};

}  // namespace penumbra::render
