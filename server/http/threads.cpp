#include "server/http/threads.h"

#include <system_error>
#include <utility>

namespace penumbra::http {

void Threads::run(std::function<void()> task) {
  std::unique_lock lock(mutex_);
  tasks_.push_back(std::move(task));
  if (tasks_.size() > idle_ && threads_.size() < max_threads_) {
    try {
      threads_.emplace_back([this] { work(); });
      return;
    } catch (const std::system_error&) {
      // The system has no more threads to give: one of those at work will come to it, or else this one does.
      if (threads_.empty()) {
        const std::function<void()> mine = std::move(tasks_.back());
        tasks_.pop_back();
        lock.unlock();
        mine();
        return;
      }
    }
  }
  changed_.notify_one();
}

void Threads::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    ++idle_;
    changed_.wait(lock, [&] { return !tasks_.empty() || is_finishing_; });
    --idle_;
    if (tasks_.empty()) return;
    const std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    lock.lock();
  }
}

void Threads::finish() {
  std::vector<std::jthread> threads;
  {
    const std::lock_guard lock(mutex_);
    is_finishing_ = true;
    threads.swap(threads_);
  }
  changed_.notify_all();
  for (std::jthread& thread : threads) thread.join();
}

}  // namespace penumbra::http
