#pragma once
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace penumbra::http {

/// Threads made as they are needed, up to a maximum, and then kept. What is handed in always runs, if need be later.
/// May be shared between threads.
class Threads {
 public:
  explicit Threads(std::size_t max_threads) : max_threads_(max_threads) {}
  ~Threads() { finish(); }
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  /// `task` must not throw.
  void run(std::function<void()> task);
  /// Runs what is left and returns when every thread has ended.
  void finish();

 private:
  void work();

  const std::size_t max_threads_;
  std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by mutex_:
  std::deque<std::function<void()>> tasks_;
  std::vector<std::jthread> threads_;
  std::size_t idle_ = 0;
  bool is_finishing_ = false;
};

}  // namespace penumbra::http
