#pragma once
#include <array>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>

#include "api/job_resource.h"

namespace penumbra::jobs {

/// Makes ids: 26 characters of Crockford's base 32, the first ten from the time in milliseconds, the rest random (a
/// ULID). Each is greater than the one before, byte by byte, and cannot be guessed from it. May be shared between
/// threads.
class JobIds {
 public:
  /// Those to come are greater than `newest`, unless that is no id.
  explicit JobIds(const std::string& newest = "");
  std::string next(api::Time now);

 private:
  std::mutex mutex_;
  std::string last_;  // guarded by mutex_
};

/// Whether `text` has the form of an id.
bool is_job_id(std::string_view text);

}  // namespace penumbra::jobs
