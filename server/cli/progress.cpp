#include "server/cli/progress.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

namespace penumbra::cli {

ProgressLine::ProgressLine(const render::Control& control, double interval_s)
    : is_terminal_(isatty(STDERR_FILENO) == 1) {
  constexpr double least_s = 0.02, smooth_s = 0.1;
  const std::chrono::duration<double> interval(is_terminal_ ? smooth_s : std::max(interval_s, least_s));
  report(0);
  reporter_ = std::jthread([this, &control, interval](const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (!stopped_.wait_for(lock, stop, interval, [&] { return stop.stop_requested(); })) {
      // The last of it, writing the file, is not the render's to count.
      report(std::min(control.percent(), 99.9));
    }
  });
}

void ProgressLine::report(double percent) {
  if (percent == reported_ && !is_terminal_) return;
  reported_ = percent;
  std::fprintf(stderr, is_terminal_ ? "\r%5.1f %%" : "%.1f %%\n", percent);
}

void ProgressLine::stop(bool is_complete) {
  if (!reporter_.joinable()) return;
  reporter_.request_stop();
  reporter_.join();
  if (is_complete) report(100);
  if (is_terminal_) std::fputc('\n', stderr);
}

}  // namespace penumbra::cli
