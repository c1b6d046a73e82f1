#include "server/http/submit.h"

#include <algorithm>

#include "api/problems.h"

namespace penumbra::http {

namespace {

constexpr std::size_t max_key_bytes = 255;

bool is_key(std::string_view text) {
  return !text.empty() && text.size() <= max_key_bytes &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x20 && c < 0x7f; });
}

}  // namespace

std::variant<jobs::Submission, Response> submit(const Request& request, jobs::JobManager& manager, bool is_waiting) {
  std::optional<std::string> key;
  if (const auto given = request.fields[Field::idempotency_key]) {
    if (!is_key(*given))
      return problem_response(api::bad_parameter("Idempotency-Key must be 1 to 255 printable ASCII characters"));
    key = std::string(*given);
  }
  jobs::Submission submission =
      manager.submit(std::string(request.body), key, {request.caller.owner, request.caller.max_jobs, is_waiting});
  switch (submission.outcome) {
    case jobs::Submission::Outcome::accepted:
    case jobs::Submission::Outcome::repeated:
      return submission;
    case jobs::Submission::Outcome::key_conflict:
      return problem_response(api::idempotency_conflict());
    case jobs::Submission::Outcome::queue_full:
      return problem_response(api::queue_full(manager.counts().max_queued), submission.retry_after_s);
    case jobs::Submission::Outcome::owner_full:
      return problem_response(api::too_many_jobs(request.caller.max_jobs.value_or(0)), submission.retry_after_s);
    case jobs::Submission::Outcome::storage_full:
      return problem_response(api::insufficient_storage("this server's disk is too full for jobs"));
    case jobs::Submission::Outcome::stopping:
      break;
  }
  return stopping_response();
}

Response image_response(const Request& request, const store::FoundImage& found) {
  if (found.state == store::ImageState::expired) return problem_response(api::image_expired());
  const std::string tag = entity_tag(found.image.sha256);
  Response response{
      200, found.image.media_type, found.image.bytes, {{"ETag", tag}, {"Cache-Control", "private, no-cache"}}};
  if (request.method == "GET" && names_tag(request.fields, tag)) {
    response.status = 304;
    response.media_type.clear();
    response.body = std::string();
  }
  return response;
}

Response unsuccessful_response(const api::JobResource& job) {
  if (job.state == api::JobState::canceled) return problem_response(api::job_canceled());
  return problem_response(job.error.value_or(api::internal_error()));
}

}  // namespace penumbra::http
