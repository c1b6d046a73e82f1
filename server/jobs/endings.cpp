#include "server/jobs/endings.h"

#include <cstdio>

namespace penumbra::jobs {

store::Ending failure(api::Problem problem) {
  store::Ending ending;
  ending.state = api::JobState::failed;
  ending.percent = 0;
  ending.error = std::move(problem);
  return ending;
}

store::Ending not_stored() {
  return failure({"/problems/insufficient-storage",
                  "The disk is too full",
                  507,
                  "the image was rendered but cannot be stored",
                  {}});
}

store::Ending stopped(StopReason reason, double time_limit_s) {
  if (reason == StopReason::out_of_time) {
    char detail[128];
    std::snprintf(detail, sizeof detail, "the job was stopped after %g seconds, the limit of this server",
                  time_limit_s);
    return failure({"/problems/time-limit", "The job took too long", 422, detail, {}});
  }
  store::Ending ending;
  ending.state = api::JobState::canceled;
  ending.percent = 0;
  return ending;
}

}  // namespace penumbra::jobs
