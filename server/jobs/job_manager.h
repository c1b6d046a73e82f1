#pragma once
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include "api/job_request.h"
#include "api/job_resource.h"
#include "engine/system/pool.h"
#include "server/jobs/held_jobs.h"
#include "server/jobs/job_ids.h"
#include "server/jobs/live_job.h"
#include "server/jobs/render_queue.h"
#include "server/jobs/retention_clock.h"
#include "server/jobs/turns.h"
#include "server/store/job_store.h"

namespace penumbra::jobs {

struct Settings {
  int jobs = 4;  // renders running at once
  std::size_t max_queued = 256;
  std::size_t max_queued_bytes = 256u << 20;  // of the bodies of waiting jobs
  /// Predicted, of all renders that run; one that needs more waits until it can run alone.
  std::size_t max_running_bytes = std::numeric_limits<std::size_t>::max();
  std::optional<double> time_limit_s;  // of each render
  api::Limits limits;
  store::Retention retention;
  /// Told of each job that starts and of each render that gave an image, in the thread that runs it.
  std::function<void(double waited_s)> on_start;
  std::function<void(const render::Stats& stats)> on_image;
};

inline constexpr int thumbnail_edge = 256;  // pixels

/// Whose job it is, how many unfinished ones they may have, and whether they wait for the image: when the last of those
/// has given the job up, nobody wants it.
struct Submitter {
  std::string owner;
  std::optional<std::size_t> max_jobs;
  bool is_waiting = false;
};

struct Submission {
  enum class Outcome { accepted, repeated, key_conflict, queue_full, owner_full, storage_full, stopping };
  Outcome outcome = Outcome::accepted;
  api::JobResource job;   // when accepted or repeated
  int retry_after_s = 1;  // when a queue is full
  /// While this lives, retention takes neither the job nor its image. The manager must outlive it.
  HeldJobs::Hold hold;
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
  std::size_t queued = 0, running = 0, renders = 0, max_queued = 0;  // equal jobs share a render
  std::uint64_t accepted = 0, succeeded = 0, failed = 0, canceled = 0, refused = 0;
};

/// The life of jobs: a bounded queue, higher priority first and then the older one, from which a fixed number of jobs
/// render at once on the shared pool. A job whose image is known has it at once, and equal jobs render together.
/// Whatever a render throws fails its jobs alone. May be shared between threads.
class JobManager {
 public:
  /// Takes up what the store has left unfinished. Store and pool must outlive the manager.
  JobManager(const Settings& settings, store::JobStore& store, system::Pool& pool);
  /// Stops.
  ~JobManager();
  JobManager(const JobManager&) = delete;
  JobManager& operator=(const JobManager&) = delete;

  /// Checks the body, stores the job and queues it. Throws api::InvalidBody.
  Submission submit(std::string body, const std::optional<std::string>& idempotency_key,
                    const Submitter& submitter = {});

  /// Of a job; nothing when there is none.
  std::optional<std::string> owner_of(const std::string& id) const;

  std::optional<api::JobResource> find(const std::string& id) const;
  /// The job once it has ended, or as it is at `deadline` or when the server stops; nothing when there is none, or none
  /// any more.
  std::optional<api::JobResource> wait(const std::string& id, Clock::time_point deadline) const;
  /// Newest first; `page_token` is that of the page before.
  JobList list(const store::Filter& filter, std::size_t limit, const std::optional<std::string>& page_token) const;
  /// Asks an unfinished job to stop: a queued one has ended when this returns, a running one soon will. Throws
  /// StorageFull when the end of a queued one cannot be stored.
  std::optional<api::JobResource> cancel(const std::string& id);
  /// For a caller that `submit` has answered with the job and that wants it no more: the last one cancels it.
  void give_up(const std::string& id);
  /// Forgets a job; cancels it first where needed. False when there is none.
  bool remove(const std::string& id);

  std::optional<store::FoundImage> image(const std::string& id) const;
  /// A PNG of the image with at most `thumbnail_edge` pixels at the longer edge.
  std::optional<store::FoundImage> thumbnail(const std::string& id) const;
  /// The body as it was submitted; nothing when there is no such job, or the body is kept no more.
  std::optional<std::string> scene(const std::string& id) const { return store_.spec(id); }
  std::optional<Preview> preview(const std::string& id) const;
  /// Least seconds between two progress reports of this job.
  std::optional<double> progress_interval_s(const std::string& id) const;

  /// False once the end has come near: `submit` then refuses.
  bool is_accepting() const;
  /// Refuses new jobs from now on.
  void stop_accepting();
  /// Leaves what is unfinished in the store, for the next start, and returns when no render is left.
  void stop();
  /// True from `stop` on: waiting for jobs is in vain.
  bool is_stopping() const;

  Counts counts() const;
  const api::Limits& limits() const { return settings_.limits; }

 private:
  void recover();
  /// The job that a key has already made, or that it cannot; nothing when the key is free.
  std::optional<Submission> repeated(const store::IdempotencyKey& key);
  /// A fresh job that is known from now on, or why there is none.
  std::variant<std::shared_ptr<LiveJob>, Submission> admit(store::JobRecord record, std::size_t body_bytes,
                                                           const Submitter& submitter);
  /// What becomes of a job that has been stored.
  Submission enter(const std::shared_ptr<LiveJob>& job, const store::JobRecord& stored,
                   std::unique_ptr<api::JobRequest> request, std::size_t body_bytes);
  void run_jobs(const std::stop_token& stop);
  void keep_time(const std::stop_token& stop);
  void run(const std::shared_ptr<SharedRender>& render);
  /// What to render, from memory or from the store; nothing when no job wants it any more.
  std::unique_ptr<api::JobRequest> request_of(SharedRender& render) const;
  /// Nothing when the server stops before it is done.
  std::optional<store::Ending> start_and_render(const std::shared_ptr<SharedRender>& render);
  std::optional<store::Ending> rendered(SharedRender& render, const api::JobRequest& request);
  void start(LiveJob& job, const std::shared_ptr<SharedRender>& render);
  /// When not even a few bytes can be stored: wait until they can, or throw StorageFull.
  enum class WhenFull { wait, fail };
  void end(LiveJob& job, store::Ending ending, WhenFull when_full = WhenFull::wait);
  /// Of a job whose cancel has been accepted: it is on its way there.
  void free_key(const std::string& id);
  /// Ends a job that was taken from the queue; it is there again when this throws.
  void end_waiting(const std::shared_ptr<LiveJob>& job);
  /// Stores how the job ended, or, when that is too much, that it could not be stored. False when the server must leave
  /// the job as it is.
  bool store_ending(const LiveJob& job, store::Ending& ending, WhenFull when_full);
  /// The server ends before the job, which stays queued in the store.
  void leave(LiveJob& job);
  /// running → queued in the store.
  void put_back(const LiveJob& job);
  void expire();
  std::shared_ptr<LiveJob> find_live(const std::string& id) const;
  int retry_after_s() const;
  /// What a stopping server has left queued in the store is canceled there.
  void cancel_left(const std::string& id);
  void claim(const std::string& id);
  /// Both need mutex_ held.
  void add_live(const std::shared_ptr<LiveJob>& job);
  void drop_live(const std::string& id);

  const Settings settings_;
  store::JobStore& store_;
  system::Pool& pool_;
  JobIds ids_;
  HeldJobs held_;
  const store::Retention retention_;  // of the settings, but for what is held
  RetentionClock retention_clock_;
  Turns key_turns_;  // of those who submit with the same key
  RenderQueue queue_;

  mutable std::mutex mutex_;
  std::condition_variable_any time_passes_;
  // Guarded by mutex_, under which nobody but the queue is called:
  std::unordered_map<std::string, std::shared_ptr<LiveJob>> live_;  // being stored, queued and running
  std::map<std::string, std::size_t> live_of_;                      // how many of them by owner
  bool is_accepting_ = true, is_stopping_ = false;
  double average_s_ = 1;  // of recent renders
  Counts totals_;

  std::vector<std::jthread> runners_;
  std::jthread timekeeper_;
};

}  // namespace penumbra::jobs
