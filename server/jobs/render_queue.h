#pragma once
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/jobs/live_job.h"
#include "server/jobs/shared_render.h"

namespace penumbra::jobs {

/// The renders that wait, higher priority first and then the older one – whose job has the lesser id, so that the order
/// is the same after a restart –, those that run, and who takes part in them: jobs with the same image share one. May
/// be shared between threads: the queue guards with a lock of its own whatever it knows of jobs and renders, and calls
/// nobody while it holds it.
class RenderQueue {
 public:
  /// Renders run beside each other as long as their predicted needs are at most `max_running_bytes` together; one that
  /// needs more runs alone.
  explicit RenderQueue(std::size_t max_running_bytes) : max_running_bytes_(max_running_bytes) {}

  // For whoever brings a job, or takes it back:

  enum class Entry { waits, runs, is_canceled, is_closed };
  /// Lets the job take part in the render of its hash, or in a new one, which waits. A render that waits has the
  /// highest priority of its jobs. Not a job that is to be canceled, and none after `close`.
  Entry attach(const std::shared_ptr<LiveJob>& job, const std::string& spec_hash,
               std::unique_ptr<api::JobRequest> request, std::size_t body_bytes);
  enum class Cancel {
    is_yours,     // the job takes part no more: it is the caller's to end
    is_stopping,  // it was the last one of a render that runs: that has been asked to stop, and ends the job
    is_too_late,  // how it ends is decided
    is_noted,     // it has not been attached yet, and will not be
  };
  /// From now on the job is to be canceled.
  Cancel cancel(LiveJob& job);
  /// The cancel could not be stored: the job takes part again. False after `close`.
  bool attach_again(const std::shared_ptr<LiveJob>& job, const std::string& spec_hash);
  bool is_to_be_canceled(const LiveJob& job) const;

  // For the threads that render:

  /// Waits for the next render that has room; it runs from now on. Nothing when `stop` is requested.
  std::shared_ptr<SharedRender> take_next(const std::stop_token& stop);
  /// For a render whose need was not known when it was taken: waits until there is room, or it is to stop.
  void wait_for_room(SharedRender& render, std::size_t bytes);
  std::vector<std::shared_ptr<LiveJob>> jobs_of(const SharedRender& render) const;
  struct Ended {
    std::shared_ptr<LiveJob> job;
    bool is_to_be_canceled;  // whoever asked was told that it is on its way there
  };
  /// A render that ran does so no more and nobody joins it any longer: its jobs are the caller's to end.
  std::vector<Ended> finish(SharedRender& render);

  // For whoever keeps time:

  /// Asks renders that have run for longer to stop.
  void stop_overdue(double time_limit_s);
  /// Asks every render that runs to stop; the jobs of those that wait are the caller's.
  std::vector<std::shared_ptr<LiveJob>> close();

  // For everybody:

  struct Counts {
    std::size_t waiting_jobs = 0, running_jobs = 0, running_renders = 0;
  };
  Counts counts() const;
  /// Of the bodies of waiting jobs; nothing when no job waits.
  std::optional<std::size_t> waiting_bytes() const;
  /// The render a job takes part in, if there is one.
  std::shared_ptr<SharedRender> render_of(const LiveJob& job) const;
  /// The place of a job that waits; 1 is next.
  std::optional<std::int64_t> position(const LiveJob& job) const;
  /// Those of all jobs that wait.
  std::unordered_map<const LiveJob*, std::int64_t> positions() const;

 private:
  // All of them need mutex_ held.
  void enter(const std::shared_ptr<LiveJob>& job, const std::string& spec_hash,
             std::unique_ptr<api::JobRequest> request, std::size_t body_bytes);
  bool has_room(std::size_t bytes) const;
  std::shared_ptr<SharedRender> take_first();
  void place_again(const std::shared_ptr<SharedRender>& render);
  void forbid_joining(const SharedRender& render);

  const std::size_t max_running_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;  // there may be work, or room for it
  // Guarded by mutex_, as is what LiveJob and SharedRender hold for the queue:
  std::map<SharedRender::QueueKey, std::shared_ptr<SharedRender>> queue_;
  std::unordered_map<std::string, std::shared_ptr<SharedRender>> by_hash_;  // those that may be joined
  std::size_t waiting_bytes_ = 0;
  std::unordered_map<SharedRender*, std::shared_ptr<SharedRender>> running_;
  std::size_t running_bytes_ = 0;             // the sum of what they hold
  std::shared_ptr<SharedRender> unmeasured_;  // taken from the queue, not known yet what memory it needs
  bool is_closed_ = false;
};

}  // namespace penumbra::jobs
