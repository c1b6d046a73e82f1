#include <charconv>

#include "api/problems.h"
#include "server/http/routes.h"
#include "server/http/submit.h"
#include "server/jobs/job_ids.h"
#include "server/store/sha256.h"

namespace penumbra::http {

namespace {

using jobs::JobManager;

constexpr std::size_t default_page = 50, max_page = 1000;

Response no_such_job() { return problem_response(api::no_such_job()); }

std::string location_of(const std::string& id) { return "/v1/jobs/" + id; }

Response create_job(const Request& request, JobManager& manager) {
  const std::string_view validate_only = request.parameter("validate_only").value_or("false");
  if (validate_only != "true" && validate_only != "false")
    return problem_response(api::bad_parameter("validate_only must be true or false"));
  if (validate_only == "true")
    return json_response(200, api::to_json(api::estimate_cost(api::parse_job(request.body, manager.limits()))));
  const auto submitted = submit(request, manager, false);
  if (const auto* refusal = std::get_if<Response>(&submitted)) return *refusal;
  const api::JobResource& job = std::get<jobs::Submission>(submitted).job;
  Response response = json_response(202, api::to_json(job));
  response.headers.emplace_back("Location", location_of(job.id));
  return response;
}

Response list_jobs(const Request& request, const JobManager& manager) {
  store::Filter filter;
  if (!request.caller.is_everybody) filter.owner = request.caller.owner;
  if (const auto name = request.parameter("state")) {
    filter.state = api::job_state_of(*name);
    if (!filter.state)
      return problem_response(api::bad_parameter("state must be queued, running, succeeded, failed or canceled"));
  }
  std::size_t limit = default_page;
  if (const auto text = request.parameter("limit")) {
    const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), limit);
    if (error != std::errc() || end != text->data() + text->size() || limit < 1 || limit > max_page)
      return problem_response(api::bad_parameter("limit must be a whole number from 1 to " + std::to_string(max_page)));
  }
  std::optional<std::string> token;
  if (const auto text = request.parameter("page_token")) {
    if (!jobs::is_job_id(*text)) return problem_response(api::bad_parameter("page_token is not one of this server"));
    token = std::string(*text);
  }
  const jobs::JobList list = manager.list(filter, limit, token);
  return json_response(200, api::to_json(list.jobs, list.next_page_token));
}

Response find_job(const Request& request, const JobManager& manager) {
  const std::optional<api::JobResource> job = manager.find(request.id);
  return job ? json_response(200, api::to_json(*job)) : no_such_job();
}

Response cancel_job(const Request& request, JobManager& manager) {
  const std::optional<api::JobResource> job = manager.cancel(request.id);
  if (!job) return no_such_job();
  if (job->state == api::JobState::succeeded || job->state == api::JobState::failed)
    return problem_response(api::already_ended("the job has already " + std::string(api::name_of(job->state))));
  return json_response(200, api::to_json(*job));
}

Response delete_job(const Request& request, JobManager& manager) {
  if (!manager.remove(request.id)) return no_such_job();
  return {204, "", std::string(), {}};
}

Response no_image_of(const api::JobResource& job) {
  switch (job.state) {
    case api::JobState::queued:
    case api::JobState::running:
      return problem_response(api::no_image("the job is not finished"), 1);
    default:
      return problem_response(api::no_image("the job was " + std::string(api::name_of(job.state))));
  }
}

Response picture_of(const Request& request, const JobManager& manager, const std::optional<store::FoundImage>& found) {
  if (!found) return no_such_job();
  if (found->state != store::ImageState::none) return image_response(request, *found);
  const std::optional<api::JobResource> job = manager.find(request.id);
  return job ? no_image_of(*job) : no_such_job();
}

Response job_image(const Request& request, const JobManager& manager) {
  return picture_of(request, manager, manager.image(request.id));
}

Response job_thumbnail(const Request& request, const JobManager& manager) {
  return picture_of(request, manager, manager.thumbnail(request.id));
}

Response job_scene(const Request& request, const JobManager& manager) {
  std::optional<std::string> body = manager.scene(request.id);
  if (!body) return manager.find(request.id) ? problem_response(api::scene_expired()) : no_such_job();
  std::string sha256 = store::sha256_hex(*body);
  auto bytes = std::make_shared<const std::string>(std::move(*body));
  return image_response(request, {store::ImageState::present,
                                  {std::move(bytes), "application/json", std::move(sha256), nullptr, nullptr}});
}

Response job_preview(const Request& request, const JobManager& manager) {
  const std::optional<jobs::Preview> preview = manager.preview(request.id);
  if (!preview) return no_such_job();
  switch (preview->state) {
    case jobs::Preview::State::present:
      return {200, "image/png", preview->png, {{"Cache-Control", "no-store"}}};
    case jobs::Preview::State::expired:
      return problem_response(api::image_expired());
    case jobs::Preview::State::not_yet:
      return problem_response(api::no_image("the job has not started"), 1);
    case jobs::Preview::State::none:
      break;
  }
  return problem_response(api::no_image("the job has ended without an image"));
}

}  // namespace

void add_job_routes(Router& router, JobManager& manager) {
  using access::Scope;
  const std::string job = "/v1/jobs/{id}";
  using Names = std::vector<std::string_view>;
  const auto get = [&](const std::string& path, auto answer, bool takes_token = false, const Names& parameters = {}) {
    const auto handler = [&manager, answer](const Request& r) { return answer(r, manager); };
    router.add({"GET", path, Body::none, handler, Scope::read, {}, takes_token, parameters});
  };
  const auto change = [&](const char* method, const std::string& path, Body body, auto answer,
                          const Names& parameters = {}) {
    const auto handler = [&manager, answer](const Request& r) { return answer(r, manager); };
    router.add({method, path, body, handler, Scope::write, {}, false, parameters});
  };
  change("POST", "/v1/jobs", Body::json, create_job, {"validate_only"});
  get("/v1/jobs", list_jobs, false, {"state", "limit", "page_token"});
  get(job, find_job);
  change("DELETE", job, Body::none, delete_job);
  change("POST", job + "/cancel", Body::none, cancel_job);
  get(job + "/image", job_image, true);
  get(job + "/preview", job_preview, true);
  get(job + "/thumbnail", job_thumbnail, true);
  get(job + "/scene", job_scene);
}

}  // namespace penumbra::http
