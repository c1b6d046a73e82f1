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

store::Ending stopped(StopReason reason, double time_limit_s) {
  switch (reason) {
    case StopReason::canceled: {
      store::Ending ending;
      ending.state = api::JobState::canceled;
      ending.percent = 0;
      return ending;
    }
    case StopReason::out_of_time: {
      char detail[128];
      std::snprintf(detail, sizeof detail, "the job was stopped after %g seconds, the limit of this server",
                    time_limit_s);
      return failure({"/problems/time-limit", "The job took too long", 422, detail, {}});
    }
    case StopReason::server_stopped:
      break;
  }
  return failure({"/problems/server-stopped",
                  "The server stopped",
                  503,
                  "the server stopped before the job was done; send it again",
                  {}});
}

}  // namespace penumbra::jobs
