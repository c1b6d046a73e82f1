#pragma once
#include "api/problem.h"
#include "server/jobs/shared_render.h"
#include "server/store/job_store.h"

namespace penumbra::jobs {

// How jobs end; the caller fills in the time and the percentage.

/// Of a job that failed.
store::Ending failure(api::Problem problem);
/// Of a job whose result cannot be stored.
store::Ending not_stored();
/// Of a job that was canceled or out of time. `time_limit_s` is for the reason out_of_time.
store::Ending stopped(StopReason reason, double time_limit_s);

}  // namespace penumbra::jobs
