#pragma once
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

namespace penumbra::system {

/// A fixed number of threads shared fairly by every render that runs on them: a free thread always joins the render
/// that has the fewest threads at work. May be shared between threads.
class Pool {
 public:
  /// `threads` ≥ 1. With `idle_priority` the threads run under SCHED_IDLE where the system allows it.
  explicit Pool(int threads, bool idle_priority = false);
  /// Waits for running tasks; no call of `run` may be under way.
  ~Pool();
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  int size() const { return static_cast<int>(workers_.size()); }

  /// Calls task(0) … task(count − 1), each once, on at most `at_most` of the pool's threads (and never on the
  /// caller's); returns when all have returned. `task` must not throw and must not call `run`.
  void run(std::int64_t count, int at_most, const std::function<void(std::int64_t)>& task);

 private:
  struct Batch;
  void work(const std::stop_token& stop);
  std::shared_ptr<Batch> next_batch();

  std::mutex mutex_;
  std::condition_variable_any work_available_;
  std::vector<std::shared_ptr<Batch>> batches_;  // with tasks left to start; guarded by mutex_
  std::vector<std::jthread> workers_;
};

}  // namespace penumbra::system
