#pragma once
#include <chrono>
#include <map>
#include <mutex>
#include <string>

namespace penumbra::access {

/// Where a caller stands after a call.
struct Rate {
  bool is_within = true;
  int per_minute = 0;
  int remaining = 0;      // calls left at once
  int reset_s = 0;        // until all of them are back
  int retry_after_s = 0;  // when not within: until the next call is
};

/// A bucket of calls for each key, full after a minute without any (the generic cell rate algorithm, ITU-T I.371). May
/// be shared between threads.
class RateLimiter {
 public:
  using Clock = std::chrono::steady_clock;

  /// Counts a call of `key_id`, who may make `per_minute` ≥ 1.
  Rate take(const std::string& key_id, int per_minute, Clock::time_point now);

 private:
  std::mutex mutex_;
  std::map<std::string, Clock::time_point> full_at_;  // when nobody calls any more; guarded by mutex_
};

}  // namespace penumbra::access
