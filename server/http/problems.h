#pragma once
#include <string>
#include <string_view>

#include "api/problem.h"

namespace penumbra::http {

// One function a problem type of the interface: `detail` says what is wrong this time.
api::Problem bad_request(std::string detail);
api::Problem bad_parameter(std::string detail);
api::Problem not_found(std::string detail);
/// Of a job that does not exist, and of another owner's: nobody can tell which.
api::Problem no_such_job();
api::Problem key_required();
api::Problem key_unknown();
api::Problem scope_missing(std::string_view scope);
api::Problem method_not_allowed(std::string detail);
api::Problem request_timeout();
api::Problem idempotency_conflict();
api::Problem job_canceled();
api::Problem already_ended(std::string detail);
api::Problem no_image(std::string detail);
api::Problem image_expired();
api::Problem length_required();
api::Problem body_too_large(std::size_t max_bytes);
api::Problem uri_too_long(std::size_t max_bytes);
api::Problem unsupported_media_type(std::string detail);
api::Problem queue_full(std::size_t max_queued);
api::Problem too_many_jobs(std::size_t max_jobs);
api::Problem too_many_requests(int per_minute);
api::Problem headers_too_large(std::size_t max_bytes);
api::Problem internal_error();
api::Problem not_implemented(std::string detail);
api::Problem unavailable(std::string detail);
api::Problem version_not_supported();
api::Problem insufficient_storage();
/// For a status that no other function is made for.
api::Problem plain_problem(int status);

}  // namespace penumbra::http
