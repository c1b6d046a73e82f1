#pragma once
#include <string>

#include "api/job_request.h"

namespace penumbra::jobs {

/// Equal for requests that have the same image: the hash of every value that decides about a byte of it, as parsed –
/// how the body was written does not matter, nor do names, `threads`, `progress_interval_s` and `priority`. Empty when
/// the image depends on more than the request, which `time_budget_s` makes it do.
std::string spec_hash(const api::JobRequest& request);

/// Differs for engines that might render other bytes.
std::string engine_version();

}  // namespace penumbra::jobs
