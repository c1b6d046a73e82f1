#pragma once
#include <chrono>
#include <mutex>

#include "api/job_resource.h"
#include "server/jobs/shared_render.h"

namespace penumbra::jobs {

/// The time of day by which things grow old. It goes on as the monotonic clock does: a system clock that is wrong for a
/// moment ages nothing. One that stays elsewhere for an hour was set, and is followed. May be shared between threads.
class RetentionClock {
 public:
  RetentionClock(api::Time now, Clock::time_point steady_now) : told_(now), steady_(steady_now), agreed_(steady_now) {}

  /// `now` is what the system clock says.
  api::Time tell(api::Time now, Clock::time_point steady_now) {
    using namespace std::chrono_literals;
    constexpr auto difference = 1min, patience = 60min;
    const std::lock_guard lock(mutex_);
    told_ += std::chrono::duration_cast<api::Time::duration>(steady_now - steady_);
    steady_ = steady_now;
    const auto away = now - told_;
    const bool is_agreed = away > -difference && away < difference;
    if (is_agreed || steady_now - agreed_ > patience) {
      agreed_ = steady_now;
      told_ = now;
    }
    return told_;
  }

 private:
  std::mutex mutex_;
  // Guarded by mutex_:
  api::Time told_;
  Clock::time_point steady_;  // when that was
  Clock::time_point agreed_;  // when both clocks last said the same
};

}  // namespace penumbra::jobs
