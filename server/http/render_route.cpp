#include "api/problems.h"
#include "server/http/routes.h"
#include "server/http/submit.h"

namespace penumbra::http {

namespace {

using jobs::Clock;
using jobs::JobManager;

constexpr auto client_check_interval = std::chrono::milliseconds(250);

Response render(const Request& request, JobManager& manager) {
  const auto submitted = submit(request, manager, true);
  if (const auto* refusal = std::get_if<Response>(&submitted)) return *refusal;
  const auto& submission = std::get<jobs::Submission>(submitted);
  const std::string& id = submission.job.id;
  std::optional<api::JobResource> job = submission.job;
  while (job && !api::is_final(job->state)) {
    // The end of the job wakes this at once; the interval is for clients that leave, and for keys.
    job = manager.wait(id, Clock::now() + client_check_interval);
    // The job stays queued: the same body sent again joins it, or finds its image.
    if (job && !api::is_final(job->state) && manager.is_stopping()) return stopping_response();
    if (job && !api::is_final(job->state) && !request.is_wanted()) {
      manager.give_up(id);
      return problem_response(api::job_canceled());
    }
  }
  if (!job) return problem_response(api::job_canceled());
  if (job->state != api::JobState::succeeded) return unsuccessful_response(*job);
  const std::optional<store::FoundImage> found = manager.image(id);
  if (!found) return problem_response(api::image_expired());
  Response response = image_response(request, *found);
  response.headers.emplace_back("X-Job-Id", id);
  response.headers.emplace_back("Content-Location", "/v1/jobs/" + id + "/image");
  return response;
}

}  // namespace

void add_render_route(Router& router, JobManager& manager) {
  router.add(
      {"POST", "/v1/render", Body::json, [&](const Request& r) { return render(r, manager); }, access::Scope::write});
}

}  // namespace penumbra::http
