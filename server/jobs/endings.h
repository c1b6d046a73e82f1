#pragma once
#include "api/problem.h"
#include "server/jobs/live_job.h"
#include "server/store/job_store.h"

namespace penumbra::jobs {

/// A failed job; the caller fills in the time and the percentage.
store::Ending failure(api::Problem problem);
/// Of a job that was stopped, likewise. `time_limit_s` is for the reason out_of_time.
store::Ending stopped(StopReason reason, double time_limit_s);

}  // namespace penumbra::jobs
