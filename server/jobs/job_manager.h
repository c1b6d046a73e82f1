#pragma once
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "api/job_request.h"
#include "api/job_resource.h"
#include "engine/render/pool.h"
#include "server/jobs/job_ids.h"
#include "server/jobs/live_job.h"
#include "server/store/job_store.h"

namespace penumbra::jobs {

struct Settings {
  int jobs = 4;  // renders running at once
  std::size_t max_queued = 256;
  std::size_t max_queued_bytes = 256u << 20;  // of the bodies of waiting jobs
  std::optional<double> time_limit_s;         // of each render
  api::Limits limits;
  store::Retention retention;
  /// Told of each job in the thread that runs it.
  std::function<void(double waited_s)> on_start;
  std::function<void(const store::Ending& without_image)> on_end;
};

/// Whose job it is, and how many unfinished ones they may have.
struct Submitter {
  std::string owner;
  std::optional<std::size_t> max_jobs;
};

struct Submission {
  enum class Outcome { accepted, repeated, key_conflict, queue_full, owner_full, stopping };
  Outcome outcome = Outcome::accepted;
  api::JobResource job;   // when accepted or repeated
  int retry_after_s = 1;  // when a queue is full
};

struct JobList {
  std::vector<api::JobResource> jobs;
  std::optional<std::string> next_page_token;
};

struct Preview {
  enum class State { present, not_yet, none, expired };
  State state = State::none;
  std::shared_ptr<const std::string> png;  // when present
};

/// What has happened since the start, and what goes on now.
struct Counts {
  std::size_t queued = 0, running = 0, max_queued = 0;
  std::uint64_t accepted = 0, succeeded = 0, failed = 0, canceled = 0, refused = 0;
};

/// The life of jobs: a bounded queue, higher priority first and then the older one, from which a fixed number of jobs
/// render at once on the shared pool. Whatever a render throws fails that job alone. May be shared between threads.
class JobManager {
 public:
  /// Takes up what the store has left unfinished. Store and pool must outlive the manager.
  JobManager(const Settings& settings, store::JobStore& store, render::Pool& pool);
  /// Stops.
  ~JobManager();
  JobManager(const JobManager&) = delete;
  JobManager& operator=(const JobManager&) = delete;

  /// Checks the body and queues the job. Throws api::InvalidBody.
  Submission submit(std::string body, const std::optional<std::string>& idempotency_key,
                    const Submitter& submitter = {});

  /// Of a job; nothing when there is none.
  std::optional<std::string> owner_of(const std::string& id) const;

  std::optional<api::JobResource> find(const std::string& id) const;
  /// The job once it has ended, or as it is at `deadline`; nothing when there is none, or none any more.
  std::optional<api::JobResource> wait(const std::string& id, Clock::time_point deadline) const;
  /// Newest first; `page_token` is that of the page before.
  JobList list(const store::Filter& filter, std::size_t limit, const std::optional<std::string>& page_token) const;
  /// Asks an unfinished job to stop: a queued one has ended when this returns, a running one soon will.
  std::optional<api::JobResource> cancel(const std::string& id);
  /// Forgets a job; cancels it first where needed. False when there is none.
  bool remove(const std::string& id);

  std::optional<store::FoundImage> image(const std::string& id) const;
  std::optional<Preview> preview(const std::string& id) const;
  /// Least seconds between two progress reports of this job.
  std::optional<double> progress_interval_s(const std::string& id) const;

  /// False once the end has come near: `submit` then refuses.
  bool is_accepting() const;
  /// Refuses new jobs from now on.
  void stop_accepting();
  /// Fails every unfinished job as stopped by the server and returns when no render is left.
  void stop();

  Counts counts() const;
  const api::Limits& limits() const { return settings_.limits; }

 private:
  using QueueKey = std::pair<int, std::uint64_t>;  // (−priority, sequence): the least is next

  static QueueKey key_of(const LiveJob& job) { return {-job.priority(), job.sequence}; }
  void recover();
  void run_jobs(const std::stop_token& stop);
  void keep_time(const std::stop_token& stop);
  void run(LiveJob& job);
  store::Ending rendered(LiveJob& job, const api::JobRequest& request);
  void end(LiveJob& job, store::Ending ending);
  std::shared_ptr<LiveJob> find_live(const std::string& id) const;
  /// Of the waiting jobs, by id; 1 is next. mutex_ must be held.
  std::optional<std::int64_t> queue_position(const LiveJob& job) const;
  /// True when the job was waiting and now is the caller's to end. mutex_ must be held.
  bool take_from_queue(const LiveJob& job);
  int retry_after_s() const;
  /// Both need mutex_ held.
  void add_live(const std::shared_ptr<LiveJob>& job);
  void drop_live(const std::string& id);

  const Settings settings_;
  store::JobStore& store_;
  render::Pool& pool_;
  JobIds ids_;

  mutable std::mutex mutex_;
  std::condition_variable_any work_available_, time_passes_;
  // Guarded by mutex_:
  std::map<QueueKey, std::shared_ptr<LiveJob>> queue_;
  std::unordered_map<std::string, std::shared_ptr<LiveJob>> live_;  // queued and running
  std::map<std::string, std::size_t> live_of_;                      // how many of them by owner
  std::uint64_t next_sequence_ = 0;
  std::size_t queued_bytes_ = 0;
  std::size_t reserved_ = 0;  // places of jobs that are being stored
  std::size_t running_ = 0;
  bool is_accepting_ = true;
  double average_s_ = 1;  // of recent jobs
  Counts totals_;

  std::vector<std::jthread> runners_;
  std::jthread timekeeper_;
};

}  // namespace penumbra::jobs
