#include "server/http/problems.h"

namespace penumbra::http {

namespace {

std::string bytes(std::size_t count) { return std::to_string(count) + " bytes"; }

}  // namespace

api::Problem bad_request(std::string detail) {
  return {"/problems/bad-request", "The request is not valid HTTP", 400, std::move(detail), {}};
}

api::Problem bad_parameter(std::string detail) {
  return {"/problems/bad-parameter", "A parameter is wrong", 400, std::move(detail), {}};
}

api::Problem not_found(std::string detail) { return {"/problems/not-found", "Not found", 404, std::move(detail), {}}; }

api::Problem no_such_job() { return not_found("there is no such job"); }

api::Problem key_required() {
  return {"/problems/key-required", "A key is required", 401, "send the header Authorization: Bearer rs_…", {}};
}

api::Problem key_unknown() {
  return {"/problems/key-unknown", "The key is not known", 401, "this server does not know the key", {}};
}

api::Problem scope_missing(std::string_view scope) {
  return {"/problems/scope-missing", "The key may not do this", 403, "it lacks the scope " + std::string(scope), {}};
}

api::Problem method_not_allowed(std::string detail) {
  return {"/problems/method-not-allowed", "The method is not allowed", 405, std::move(detail), {}};
}

api::Problem request_timeout() {
  return {"/problems/request-timeout", "The request came too slowly", 408, "the request did not arrive in time", {}};
}

api::Problem idempotency_conflict() {
  return {"/problems/idempotency-conflict",
          "The Idempotency-Key is taken",
          409,
          "this Idempotency-Key was used with another body",
          {}};
}

api::Problem job_canceled() {
  return {"/problems/job-canceled", "The job was canceled", 409, "the job was canceled before it was done", {}};
}

api::Problem already_ended(std::string detail) {
  return {"/problems/job-ended", "The job has ended", 409, std::move(detail), {}};
}

api::Problem no_image(std::string detail) {
  return {"/problems/no-image", "There is no image", 409, std::move(detail), {}};
}

api::Problem image_expired() {
  return {"/problems/image-expired", "The image has expired", 410, "the image was kept for its time and is gone", {}};
}

api::Problem length_required() {
  return {"/problems/length-required", "A Content-Length is required", 411, "the request has no Content-Length", {}};
}

api::Problem body_too_large(std::size_t max_bytes) {
  return {"/problems/body-too-large", "The body is too large", 413, "at most " + bytes(max_bytes) + " are allowed", {}};
}

api::Problem uri_too_long(std::size_t max_bytes) {
  return {"/problems/uri-too-long", "The path is too long", 414, "at most " + bytes(max_bytes) + " are allowed", {}};
}

api::Problem unsupported_media_type(std::string detail) {
  return {"/problems/unsupported-media-type", "The body has the wrong type", 415, std::move(detail), {}};
}

api::Problem queue_full(std::size_t max_queued) {
  return {"/problems/queue-full",
          "The queue is full",
          429,
          "as many jobs wait as this server allows, " + std::to_string(max_queued) + " or their bodies' bytes",
          {}};
}

api::Problem too_many_jobs(std::size_t max_jobs) {
  return {"/problems/too-many-jobs",
          "Too many unfinished jobs",
          429,
          "at most " + std::to_string(max_jobs) + " unfinished jobs are allowed with this key",
          {}};
}

api::Problem too_many_requests(int per_minute) {
  return {"/problems/too-many-requests",
          "Too many requests",
          429,
          "at most " + std::to_string(per_minute) + " requests a minute are allowed with this key",
          {}};
}

api::Problem headers_too_large(std::size_t max_bytes) {
  return {"/problems/headers-too-large",
          "The header fields are too large",
          431,
          "at most " + bytes(max_bytes) + " are allowed",
          {}};
}

api::Problem internal_error() {
  return {"/problems/internal-error", "Something went wrong", 500, "the server's log says what", {}};
}

api::Problem not_implemented(std::string detail) {
  return {"/problems/not-implemented", "Not implemented", 501, std::move(detail), {}};
}

api::Problem unavailable(std::string detail) {
  return {"/problems/unavailable", "The server cannot take this now", 503, std::move(detail), {}};
}

api::Problem version_not_supported() {
  return {"/problems/http-version", "The HTTP version is not supported", 505, "HTTP/1.1 and HTTP/1.0 are", {}};
}

api::Problem insufficient_storage() {
  return {"/problems/insufficient-storage", "The disk is too full", 507, "this server's disk is too full for jobs", {}};
}

api::Problem plain_problem(int status) {
  switch (status) {
    case 400:
      return bad_request("the request is malformed, or its body ended early or came too slowly");
    case 404:
      return not_found("there is nothing at this path");
    default:
      return {"about:blank", "The request failed", status, "the request could not be answered", {}};
  }
}

}  // namespace penumbra::http
