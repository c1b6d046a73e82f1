#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/jobs/live_job.h"
#include "server/jobs/shared_render.h"

namespace penumbra::jobs {

/// The renders that wait, higher priority first and then the older one – whose job has the lesser id, so that the order
/// is the same after a restart – and who takes part in those that wait or run:
/// jobs with the same image share one. Not to be shared between threads without a lock.
class RenderQueue {
 public:
  /// Lets the job take part in the render of its hash, or in a new one, which waits. A render that waits has the
  /// highest priority of its jobs.
  void attach(const std::shared_ptr<LiveJob>& job, const std::string& spec_hash,
              std::unique_ptr<api::JobRequest> request, std::size_t body_bytes);
  /// True when the job takes part no more and is the caller's to end. False when it takes part in nothing, or when it
  /// was the last one of a render that runs: that has been asked to stop, and ends the job.
  bool detach(LiveJob& job);
  /// Predicted, of the next render; 0 when that is not known, or none waits.
  std::size_t next_memory_bytes() const { return queue_.empty() ? 0 : queue_.begin()->second->memory_bytes(); }
  /// The next render, which runs from now on; nothing when none waits.
  std::shared_ptr<SharedRender> take_next();
  /// Nobody joins any more: the jobs that take part are the caller's to end.
  std::vector<std::shared_ptr<LiveJob>> close(SharedRender& render);

  bool is_empty() const { return queue_.empty(); }
  /// Of the bodies of waiting jobs.
  std::size_t bytes() const { return bytes_; }
  /// How many jobs wait.
  std::size_t waiting_jobs() const;
  /// The place of every render that waits; 1 is next.
  std::unordered_map<const SharedRender*, std::int64_t> positions() const;
  std::optional<std::int64_t> position(const LiveJob& job) const;

 private:
  static SharedRender::QueueKey key_of(const SharedRender& render);
  void place_again(const std::shared_ptr<SharedRender>& render);
  void forbid_joining(const SharedRender& render);

  std::map<SharedRender::QueueKey, std::shared_ptr<SharedRender>> queue_;
  std::unordered_map<std::string, std::shared_ptr<SharedRender>> by_hash_;  // those that may be joined
  std::size_t bytes_ = 0;
};

}  // namespace penumbra::jobs
