#pragma once
#include <condition_variable>
#include <mutex>
#include <thread>

#include "engine/render/control.h"

namespace penumbra::cli {

/// Writes the percentage of a render to standard error while it lives: one line that changes on a terminal, a line for
/// every report elsewhere.
class ProgressLine {
 public:
  ProgressLine(const render::Control& control, double interval_s);
  ~ProgressLine() { stop(false); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// The last report, 100 when the render is complete.
  void stop(bool is_complete);

 private:
  void report(double percent);

  const bool is_terminal_;
  double reported_ = -1;
  std::mutex mutex_;
  std::condition_variable_any stopped_;
  std::jthread reporter_;
};

}  // namespace penumbra::cli
