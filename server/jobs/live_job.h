#pragma once
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>

#include "api/job_resource.h"
#include "server/jobs/shared_render.h"
#include "server/store/job_store.h"

namespace penumbra::jobs {

/// A job that waits or runs, and how it ended while someone still watches. May be shared between threads.
class LiveJob {
 public:
  explicit LiveJob(store::JobRecord record);

  const std::string& id() const { return id_; }
  const std::string& owner() const { return owner_; }
  api::Time created_at() const { return created_at_; }
  int priority() const { return priority_; }

  // For the RenderQueue alone, under its lock:
  std::shared_ptr<SharedRender> render;  // nothing while the job is being stored
  bool is_cancel_asked = false;
  // Guarded by the mutex of the JobManager:
  int claims = 1;  // calls that were answered with this job and have not given it up

  /// queued → running, as the render it takes part in does. False when the server has left the job.
  bool start(api::Time now, std::shared_ptr<const SharedRender> shared);
  void end(const store::Ending& ending);
  /// The server ends before the job does: nobody need wait any longer.
  void leave();

  /// `now`, or the last thing that has happened to the job when the clock was set back since.
  api::Time not_before(api::Time now) const;
  /// Everything but the queue position. `percent` never falls.
  api::JobResource resource() const;
  /// Returns when the job has ended or the server is about to, or at `deadline`.
  void wait_until_final(Clock::time_point deadline) const;

 private:
  const std::string id_, owner_;
  const api::Time created_at_;
  const int priority_;

  mutable std::mutex mutex_;
  mutable std::condition_variable has_ended_;
  // Guarded by mutex_:
  store::JobRecord record_;
  std::shared_ptr<const SharedRender> running_;  // the render, while it runs
  bool is_left_ = false;
};

/// The record as clients see it, without a queue position.
api::JobResource resource_of(const store::JobRecord& record);

}  // namespace penumbra::jobs
