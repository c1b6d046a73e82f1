#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/job_request.h"
#include "engine/render/control.h"

namespace penumbra::jobs {

using Clock = std::chrono::steady_clock;

class LiveJob;

enum class StopReason { canceled, out_of_time, server_stopped };

/// A render that waits or runs, for one job or for several with the same image. May be shared between threads.
class SharedRender {
 public:
  /// `request` may be missing, when the job comes from the store.
  SharedRender(std::string spec_hash, std::unique_ptr<api::JobRequest> request, std::size_t body_bytes);

  /// Empty when no other job can join.
  const std::string& spec_hash() const { return spec_hash_; }
  std::size_t body_bytes() const { return body_bytes_; }
  /// Predicted; 0 while the request is in the store alone.
  std::size_t memory_bytes() const { return memory_bytes_; }
  /// Progress out of the render, a cancel into it.
  render::Control control;

  /// What to render; nothing when it must be read from the store. Only for the thread that runs it.
  std::unique_ptr<api::JobRequest> take_request() { return std::move(request_); }

  void start(int width, int height);
  /// Makes the render return soon. The first reason counts.
  void ask_to_stop(StopReason reason);
  std::optional<StopReason> stop_reason() const;
  /// Since `start`; 0 before.
  double running_s() const;
  std::optional<double> eta_s() const;
  /// A PNG of the tiles done so far, black elsewhere; a new one at most every quarter of a second. Nothing before
  /// `start`.
  std::shared_ptr<const std::string> preview() const;

  /// (−priority, id of the oldest job): the least is next.
  using QueueKey = std::pair<int, std::string>;
  // For the RenderQueue alone, under its lock:
  std::vector<std::shared_ptr<LiveJob>> jobs;  // that are to have the image
  QueueKey key;                                // where it waits
  bool is_running = false;
  std::size_t held_bytes = 0;  // of the memory for renders, while it runs

 private:
  const std::string spec_hash_;
  const std::size_t body_bytes_, memory_bytes_;
  const double time_budget_s_;  // 0: none
  std::unique_ptr<api::JobRequest> request_;

  mutable std::mutex mutex_;
  // Guarded by mutex_:
  std::optional<StopReason> stop_reason_;
  std::optional<Clock::time_point> started_;
  int width_ = 0, height_ = 0;  // pixels

  mutable std::mutex preview_mutex_;
  // Guarded by preview_mutex_:
  mutable std::shared_ptr<const std::string> preview_;
  mutable Clock::time_point previewed_;
};

}  // namespace penumbra::jobs
