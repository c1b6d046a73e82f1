#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/problem.h"

namespace penumbra::api {

/// What every problem of one type has in common, as openapi.yaml says it too.
struct ProblemType {
  std::string_view type;
  std::string_view title;
  int status;
  std::string_view when;
};

/// Every type there is.
std::span<const ProblemType> problem_types();

// Every problem of the interface is made here: `detail` says what is wrong this time. Sizes are in bytes.
Problem bad_request(std::string detail);
Problem bad_parameter(std::string detail);
Problem not_json(std::string detail);
Problem key_required();
Problem key_unknown();
Problem scope_missing(std::string_view scope);
Problem not_found(std::string detail);
/// Of a job that does not exist, and of another owner's: nobody can tell which.
Problem no_such_job();
Problem method_not_allowed(std::string detail);
Problem request_timeout();
Problem idempotency_conflict();
Problem job_canceled();
Problem already_ended(std::string detail);
Problem no_image(std::string detail);
Problem image_expired();
Problem scene_expired();
Problem length_required();
Problem body_too_large(std::size_t max_bytes);
/// Where it is known how large the body is.
Problem body_too_large(std::size_t bytes, std::size_t max_bytes);
Problem uri_too_long(std::size_t max_bytes);
Problem unsupported_media_type(std::string detail);
Problem misdirected();
/// Lists `errors`, which must not be empty.
Problem invalid_job(std::vector<FieldError> errors);
Problem time_limit(double limit_s);
Problem queue_full(std::size_t max_queued);
Problem too_many_jobs(std::size_t max_jobs);
Problem too_many_requests(int per_minute);
Problem headers_too_large(std::size_t max_bytes);
Problem internal_error();
Problem out_of_memory();
Problem render_failed(std::string detail);
Problem crashed(int times);
Problem not_implemented(std::string detail);
Problem unavailable(std::string detail);
Problem version_not_supported();
Problem insufficient_storage(std::string detail);
/// For a status that the HTTP library chose.
Problem plain_problem(int status);

}  // namespace penumbra::api
