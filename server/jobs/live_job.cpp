#include "server/jobs/live_job.h"

#include <algorithm>

#include "engine/output/encode.h"

namespace penumbra::jobs {

namespace {

constexpr auto preview_lifetime = std::chrono::milliseconds(250);
constexpr double most_while_running = 99.99;  // 100 is for `succeeded` alone

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

}  // namespace

LiveJob::LiveJob(store::JobRecord record, std::unique_ptr<api::JobRequest> request, std::size_t body_bytes)
    : id_(record.id),
      owner_(record.owner),
      created_at_(record.created_at),
      priority_(record.priority),
      body_bytes_(body_bytes),
      time_budget_s_(request ? request->options.time_budget_s.value_or(0) : 0),
      request_(std::move(request)),
      record_(std::move(record)) {}

void LiveJob::start(api::Time now, int width, int height) {
  const std::lock_guard lock(mutex_);
  record_.state = api::JobState::running;
  record_.started_at = now;
  started_ = Clock::now();
  width_ = width, height_ = height;
}

void LiveJob::ask_to_stop(StopReason reason) {
  {
    const std::lock_guard lock(mutex_);
    if (!stop_reason_) stop_reason_ = reason;
  }
  control.cancel();
}

std::optional<StopReason> LiveJob::stop_reason() const {
  const std::lock_guard lock(mutex_);
  return stop_reason_;
}

double LiveJob::running_s() const {
  const std::lock_guard lock(mutex_);
  return started_ ? seconds_since(*started_) : 0;
}

void LiveJob::end(const store::Ending& ending) {
  {
    const std::lock_guard lock(mutex_);
    record_.state = ending.state;
    record_.percent = ending.percent;
    record_.finished_at = ending.finished_at;
    record_.error = ending.error;
    record_.stats = ending.stats;
  }
  has_ended_.notify_all();
}

std::optional<double> LiveJob::eta_s(double percent) const {
  if (!started_) return std::nullopt;
  const double elapsed_s = seconds_since(*started_);
  std::optional<double> left_s;
  // The first tiles say little about the rest.
  if (percent >= 1) left_s = elapsed_s * (100 - percent) / percent;
  if (time_budget_s_ > 0) {
    const double budget_left_s = std::max(0.0, time_budget_s_ - elapsed_s);
    left_s = std::min(left_s.value_or(budget_left_s), budget_left_s);
  }
  return left_s;
}

api::JobResource LiveJob::resource() const {
  const std::lock_guard lock(mutex_);
  if (record_.state != api::JobState::running) return resource_of(record_);
  record_.percent = std::max(record_.percent, std::min(control.percent(), most_while_running));
  api::JobResource resource = resource_of(record_);
  resource.eta_s = eta_s(record_.percent);
  return resource;
}

void LiveJob::wait_until_final(Clock::time_point deadline) const {
  std::unique_lock lock(mutex_);
  has_ended_.wait_until(lock, deadline, [&] { return api::is_final(record_.state); });
}

std::shared_ptr<const std::string> LiveJob::preview() const {
  const std::lock_guard preview_lock(preview_mutex_);
  if (preview_ && Clock::now() - previewed_ < preview_lifetime) return preview_;
  int width = 0, height = 0;
  {
    const std::lock_guard lock(mutex_);
    if (!started_) return nullptr;
    width = width_, height = height_;
  }
  render::Film done = control.preview();
  if (done.width == 0) done = render::Film(width, height);
  preview_ = std::make_shared<const std::string>(output::encode(done, output::Encoding{}));
  previewed_ = Clock::now();
  return preview_;
}

api::JobResource resource_of(const store::JobRecord& record) {
  api::JobResource resource;
  resource.id = record.id;
  resource.state = record.state;
  resource.percent = record.percent;
  resource.created_at = record.created_at;
  resource.started_at = record.started_at;
  resource.finished_at = record.finished_at;
  resource.error = record.error;
  resource.stats = record.stats;
  return resource;
}

}  // namespace penumbra::jobs
