#pragma once
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "api/job_request.h"
#include "api/job_resource.h"
#include "engine/render/control.h"
#include "server/store/job_store.h"

namespace penumbra::jobs {

using Clock = std::chrono::steady_clock;

enum class StopReason { canceled, out_of_time, server_stopped };

/// A job that waits or runs, and how it ended while someone still watches. May be shared between threads.
class LiveJob {
 public:
  /// `request` may be missing, when the job comes from the store.
  LiveJob(store::JobRecord record, std::unique_ptr<api::JobRequest> request, std::size_t body_bytes);

  const std::string& id() const { return id_; }
  const std::string& owner() const { return owner_; }
  api::Time created_at() const { return created_at_; }
  int priority() const { return priority_; }
  std::size_t body_bytes() const { return body_bytes_; }
  /// Its place among jobs of the same priority; set before the job is shared.
  std::uint64_t sequence = 0;
  /// Progress out of the render, a cancel into it.
  render::Control control;

  /// What to render; nothing when it must be read from the store. Only for the thread that runs the job.
  std::unique_ptr<api::JobRequest> take_request() { return std::move(request_); }

  /// queued → running.
  void start(api::Time now, int width, int height);
  /// Makes the render return soon. The first reason counts.
  void ask_to_stop(StopReason reason);
  std::optional<StopReason> stop_reason() const;
  /// Since `start`; 0 before.
  double running_s() const;
  void end(const store::Ending& ending);

  /// Everything but the queue position. `percent` never falls.
  api::JobResource resource() const;
  /// Returns when the job has ended, or at `deadline`.
  void wait_until_final(Clock::time_point deadline) const;

  /// A PNG of the tiles done so far, black elsewhere; a new one at most every quarter of a second. Nothing before
  /// `start`.
  std::shared_ptr<const std::string> preview() const;

 private:
  std::optional<double> eta_s(double percent) const;

  const std::string id_, owner_;
  const api::Time created_at_;
  const int priority_;
  const std::size_t body_bytes_;
  const double time_budget_s_;  // 0: none
  std::unique_ptr<api::JobRequest> request_;

  mutable std::mutex mutex_;
  mutable std::condition_variable has_ended_;
  // Guarded by mutex_:
  mutable store::JobRecord record_;
  std::optional<StopReason> stop_reason_;
  std::optional<Clock::time_point> started_;
  int width_ = 0, height_ = 0;  // pixels

  mutable std::mutex preview_mutex_;
  // Guarded by preview_mutex_:
  mutable std::shared_ptr<const std::string> preview_;
  mutable Clock::time_point previewed_;
};

/// The record as clients see it, without a queue position.
api::JobResource resource_of(const store::JobRecord& record);

}  // namespace penumbra::jobs
