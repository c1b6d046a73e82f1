#pragma once
#include <functional>
#include <thread>

namespace penumbra::cli {

/// Calls a function at the first SIGINT or SIGTERM, in a thread of its own; a SIGINT after that ends the process.
/// At every SIGHUP before another function is called; where there is none, SIGHUP is as good as SIGTERM. Must be made
/// before any other thread, for they inherit that the signals are blocked.
class StopSignals {
 public:
  explicit StopSignals(std::function<void()> on_stop, std::function<void()> on_hang_up = nullptr);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  int signal_descriptor_, end_descriptor_;
  std::jthread watcher_;
};

}  // namespace penumbra::cli
