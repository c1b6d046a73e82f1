#pragma once
#include <condition_variable>
#include <mutex>
#include <set>
#include <string>
#include <utility>

namespace penumbra::jobs {

/// Lets those who have business under the same name do it one after the other. May be shared between threads.
class Turns {
 public:
  using Name = std::pair<std::string, std::string>;

  /// The turn of whoever has made it, for as long as it lives; waits for those before.
  class Turn {
   public:
    Turn(Turns& turns, Name name) : turns_(turns), name_(std::move(name)) {
      std::unique_lock lock(turns_.mutex_);
      turns_.freed_.wait(lock, [&] { return !turns_.taken_.contains(name_); });
      turns_.taken_.insert(name_);
    }
    ~Turn() {
      {
        const std::lock_guard lock(turns_.mutex_);
        turns_.taken_.erase(name_);
      }
      turns_.freed_.notify_all();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    Turns& turns_;
    const Name name_;
  };

 private:
  std::mutex mutex_;
  std::condition_variable freed_;
  std::set<Name> taken_;  // guarded by mutex_
};

}  // namespace penumbra::jobs
