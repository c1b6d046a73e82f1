#include "server/jobs/endings.h"

#include "api/problems.h"

namespace penumbra::jobs {

store::Ending failure(api::Problem problem) {
  store::Ending ending;
  ending.state = api::JobState::failed;
  ending.percent = 0;
  ending.error = std::move(problem);
  return ending;
}

store::Ending not_stored() { return failure(api::insufficient_storage("the image was rendered but cannot be stored")); }

store::Ending stopped(StopReason reason, double time_limit_s) {
  if (reason == StopReason::out_of_time) return failure(api::time_limit(time_limit_s));
  store::Ending ending;
  ending.state = api::JobState::canceled;
  ending.percent = 0;
  return ending;
}

}  // namespace penumbra::jobs
