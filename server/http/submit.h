#pragma once
#include <string>
#include <variant>

#include "server/http/message.h"
#include "server/jobs/job_manager.h"

namespace penumbra::http {

/// Hands the body of `request` to the manager, honouring Idempotency-Key: the accepted or repeated job, or the answer
/// that says why there is none. `is_waiting`: for the image, and wants none when it leaves. Throws api::InvalidBody.
std::variant<jobs::Submission, Response> submit(const Request& request, jobs::JobManager& manager, bool is_waiting);

/// The image with its ETag (304 when If-None-Match of a GET names it), or 410.
Response image_response(const Request& request, const store::FoundImage& found);

/// The status and problem of a job that has not succeeded.
Response unsuccessful_response(const api::JobResource& job);

}  // namespace penumbra::http
