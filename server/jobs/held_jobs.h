#pragma once
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace penumbra::jobs {

/// Jobs that calls are about to answer with: retention takes nothing of them. May be shared between threads.
class HeldJobs {
 public:
  /// Lets go of the job when its last copy is gone; this must outlive it.
  using Hold = std::shared_ptr<const void>;

  Hold hold(const std::string& id) {
    {
      const std::lock_guard lock(mutex_);
      ++holds_[id];
    }
    return {this, [this, id](const void*) { let_go(id); }};
  }
  bool is_held(const std::string& id) const {
    const std::lock_guard lock(mutex_);
    return holds_.contains(id);
  }

 private:
  void let_go(const std::string& id) {
    const std::lock_guard lock(mutex_);
    const auto held = holds_.find(id);
    if (--held->second == 0) holds_.erase(held);
  }

  mutable std::mutex mutex_;
  std::map<std::string, int> holds_;  // guarded by mutex_
};

}  // namespace penumbra::jobs
