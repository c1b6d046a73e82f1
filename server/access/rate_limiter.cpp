#include "server/access/rate_limiter.h"

#include <algorithm>
#include <cmath>

namespace penumbra::access {

Rate RateLimiter::take(const std::string& key_id, int per_minute, Clock::time_point now) {
  const double limit = per_minute, per_second = limit / 60;
  const std::lock_guard lock(mutex_);
  const auto [place, is_new] = buckets_.try_emplace(key_id, Bucket{0, now});
  Bucket& bucket = place->second;
  bucket.used = std::max(0.0, bucket.used - std::chrono::duration<double>(now - bucket.at).count() * per_second);
  bucket.at = now;
  Rate rate;
  rate.per_minute = per_minute;
  rate.is_within = bucket.used + 1 <= limit;
  if (rate.is_within) {
    bucket.used += 1;
  } else {
    rate.retry_after_s = std::max(1, static_cast<int>(std::ceil((bucket.used + 1 - limit) / per_second)));
  }
  rate.remaining = static_cast<int>(std::floor(limit - bucket.used));
  rate.reset_s = static_cast<int>(std::ceil(bucket.used / per_second));
  return rate;
}

}  // namespace penumbra::access
