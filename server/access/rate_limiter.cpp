#include "server/access/rate_limiter.h"

#include <algorithm>

namespace penumbra::access {

Rate RateLimiter::take(const std::string& key_id, int per_minute, Clock::time_point now) {
  using std::chrono::ceil;
  using std::chrono::seconds;
  constexpr Clock::duration minute = std::chrono::minutes(1);
  const Clock::duration interval = minute / per_minute;
  const std::lock_guard lock(mutex_);
  Clock::time_point& full = full_at_[key_id];
  full = std::max(full, now);
  Rate rate;
  rate.per_minute = per_minute;
  rate.is_within = full + interval - now <= minute;
  if (rate.is_within)
    full += interval;
  else
    rate.retry_after_s =
        static_cast<int>(std::max<seconds::rep>(1, ceil<seconds>(full + interval - minute - now).count()));
  rate.remaining = static_cast<int>((minute - (full - now)) / interval);
  rate.reset_s = static_cast<int>(ceil<seconds>(full - now).count());
  return rate;
}

}  // namespace penumbra::access
