#include "api/problems.h"

#include <array>
#include <cstdio>

namespace penumbra::api {

namespace {

constexpr std::string_view prefix = "/problems/";

constexpr std::array types{
    ProblemType{"/problems/bad-request", "The request is not valid HTTP", 400, "The request cannot be read as HTTP."},
    ProblemType{"/problems/bad-parameter", "A parameter is wrong", 400,
                "A parameter of the query or a field is wrong."},
    ProblemType{"/problems/not-json", "The body is not JSON", 400, "The body cannot be read as JSON."},
    ProblemType{"/problems/key-required", "A key is required", 401, "The server wants a key, and none was sent."},
    ProblemType{"/problems/key-unknown", "The key is not known", 401, "The key or token is wrong, revoked or too old."},
    ProblemType{"/problems/scope-missing", "The key may not do this", 403, "The key lacks the scope of this call."},
    ProblemType{"/problems/not-found", "Not found", 404, "Nothing is there, or it belongs to another owner."},
    ProblemType{"/problems/method-not-allowed", "The method is not allowed", 405, "The path knows other methods."},
    ProblemType{"/problems/request-timeout", "The request came too slowly", 408,
                "The request took too long to arrive."},
    ProblemType{"/problems/idempotency-conflict", "The Idempotency-Key is taken", 409,
                "The Idempotency-Key was used with another body."},
    ProblemType{"/problems/job-canceled", "The job was canceled", 409, "The job was canceled while a call waited."},
    ProblemType{"/problems/job-ended", "The job has ended", 409, "The job to cancel has succeeded or failed."},
    ProblemType{"/problems/no-image", "There is no image", 409, "The job has no image, or not yet."},
    ProblemType{"/problems/image-expired", "The image has expired", 410, "The image was kept for its time."},
    ProblemType{"/problems/scene-expired", "The scene has expired", 410, "The job's body was kept for its time."},
    ProblemType{"/problems/length-required", "A Content-Length is required", 411, "The request says no length."},
    ProblemType{"/problems/body-too-large", "The body is too large", 413, "The body is over the server's limit."},
    ProblemType{"/problems/uri-too-long", "The path is too long", 414, "Path or query are over the server's limit."},
    ProblemType{"/problems/unsupported-media-type", "The body has the wrong type", 415,
                "The body is not declared as what the call takes."},
    ProblemType{"/problems/misdirected", "The request is for another host", 421,
                "The Host is none of those that the server answers for."},
    ProblemType{"/problems/invalid-scene", "The job is invalid", 422,
                "The body is JSON but no valid job, or over a limit; errors names every place."},
    ProblemType{"/problems/time-limit", "The job took too long", 422, "The render reached the server's limit of time."},
    ProblemType{"/problems/queue-full", "The queue is full", 429, "As many jobs wait as the server allows."},
    ProblemType{"/problems/too-many-jobs", "Too many unfinished jobs", 429, "The owner has as many as the key allows."},
    ProblemType{"/problems/too-many-requests", "Too many requests", 429, "The key was used too often in a minute."},
    ProblemType{"/problems/headers-too-large", "The header fields are too large", 431,
                "The header fields are over the server's limit."},
    ProblemType{"/problems/internal-error", "Something went wrong", 500, "A fault of the server, which its log names."},
    ProblemType{"/problems/out-of-memory", "Out of memory", 500, "The render needed more memory than there is."},
    ProblemType{"/problems/render-failed", "The render failed", 500, "A fault of the renderer, which the log names."},
    ProblemType{"/problems/crashed", "The server stopped working", 500,
                "The server died again and again while it rendered the job."},
    ProblemType{"/problems/not-implemented", "Not implemented", 501, "The method is none that the server knows."},
    ProblemType{"/problems/unavailable", "The server cannot take this now", 503,
                "The server is starting, stopping, or out of connections or room."},
    ProblemType{"/problems/http-version", "The HTTP version is not supported", 505, "It is neither 1.1 nor 1.0."},
    ProblemType{"/problems/insufficient-storage", "The disk is too full", 507,
                "The disk has no room for jobs or images."},
};

/// The type with this name; one that is not in the table does not compile.
consteval const ProblemType& type(std::string_view name) {
  for (const ProblemType& type : types) {
    if (type.type.substr(prefix.size()) == name) return type;
  }
  throw "no such type";
}

Problem make(const ProblemType& type, std::string detail) {
  return {std::string(type.type), std::string(type.title), type.status, std::move(detail), {}};
}

std::string at_most(std::size_t bytes) { return "at most " + std::to_string(bytes) + " bytes are allowed"; }

}  // namespace

std::span<const ProblemType> problem_types() { return types; }

Problem bad_request(std::string detail) { return make(type("bad-request"), std::move(detail)); }

Problem bad_parameter(std::string detail) { return make(type("bad-parameter"), std::move(detail)); }

Problem not_json(std::string detail) { return make(type("not-json"), std::move(detail)); }

Problem key_required() { return make(type("key-required"), "send the header Authorization: Bearer rs_…"); }

Problem key_unknown() { return make(type("key-unknown"), "this server does not know the key"); }

Problem scope_missing(std::string_view scope) {
  return make(type("scope-missing"), "it lacks the scope " + std::string(scope));
}

Problem not_found(std::string detail) { return make(type("not-found"), std::move(detail)); }

Problem no_such_job() { return not_found("there is no such job"); }

Problem method_not_allowed(std::string detail) { return make(type("method-not-allowed"), std::move(detail)); }

Problem request_timeout() { return make(type("request-timeout"), "the request did not arrive in time"); }

Problem idempotency_conflict() {
  return make(type("idempotency-conflict"), "this Idempotency-Key was used with another body");
}

Problem job_canceled() { return make(type("job-canceled"), "the job was canceled before it was done"); }

Problem already_ended(std::string detail) { return make(type("job-ended"), std::move(detail)); }

Problem no_image(std::string detail) { return make(type("no-image"), std::move(detail)); }

Problem image_expired() { return make(type("image-expired"), "the image was kept for its time and is gone"); }

Problem scene_expired() { return make(type("scene-expired"), "the job's body was kept for its time and is gone"); }

Problem length_required() { return make(type("length-required"), "the request has no Content-Length"); }

Problem body_too_large(std::size_t max_bytes) {
  return make(type("body-too-large"), "at most " + std::to_string(max_bytes) + " bytes are taken (--max-body)");
}

Problem body_too_large(std::size_t bytes, std::size_t max_bytes) {
  return make(type("body-too-large"), "the body has " + std::to_string(bytes) + " bytes; at most " +
                                          std::to_string(max_bytes) + " bytes are taken (--max-body)");
}

Problem uri_too_long(std::size_t max_bytes) { return make(type("uri-too-long"), at_most(max_bytes)); }

Problem unsupported_media_type(std::string detail) { return make(type("unsupported-media-type"), std::move(detail)); }

Problem invalid_job(std::vector<FieldError> errors) {
  const FieldError& first = errors.front();
  std::string detail = (first.pointer.empty() ? "the body" : first.pointer) + ": " + first.detail;
  if (errors.size() > 1) detail += " (and " + std::to_string(errors.size() - 1) + " more)";
  Problem problem = make(type("invalid-scene"), std::move(detail));
  problem.errors = std::move(errors);
  return problem;
}

Problem time_limit(double limit_s) {
  char detail[128];
  std::snprintf(detail, sizeof detail, "the job was stopped after %g s, the limit of this server", limit_s);
  return make(type("time-limit"), detail);
}

Problem misdirected() {
  return make(type("misdirected"), "this server answers for this machine and the names of --host alone");
}

Problem queue_full(std::size_t max_queued) {
  return make(type("queue-full"), "this server lets at most " + std::to_string(max_queued) +
                                      " jobs wait, fewer when their bodies are large; try again later");
}

Problem too_many_jobs(std::size_t max_jobs) {
  return make(type("too-many-jobs"),
              "at most " + std::to_string(max_jobs) + " unfinished jobs are allowed with this key");
}

Problem too_many_requests(int per_minute) {
  return make(type("too-many-requests"),
              "at most " + std::to_string(per_minute) + " requests a minute are allowed with this key");
}

Problem headers_too_large(std::size_t max_bytes) { return make(type("headers-too-large"), at_most(max_bytes)); }

Problem internal_error() { return make(type("internal-error"), "the server's log says what"); }

Problem out_of_memory() { return make(type("out-of-memory"), "the server ran out of memory"); }

Problem render_failed(std::string detail) { return make(type("render-failed"), std::move(detail)); }

Problem crashed(int times) {
  return make(type("crashed"), "the server stopped " + std::to_string(times) + " times while it rendered this job");
}

Problem not_implemented(std::string detail) { return make(type("not-implemented"), std::move(detail)); }

Problem unavailable(std::string detail) { return make(type("unavailable"), std::move(detail)); }

Problem version_not_supported() { return make(type("http-version"), "HTTP/1.1 and HTTP/1.0 are"); }

Problem insufficient_storage(std::string detail) { return make(type("insufficient-storage"), std::move(detail)); }

Problem plain_problem(int status) {
  if (status == 400) return bad_request("the request is malformed, or its body ended early or came too slowly");
  if (status == 404) return not_found("there is nothing at this path");
  return internal_error();
}

}  // namespace penumbra::api
