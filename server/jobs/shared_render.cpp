#include "server/jobs/shared_render.h"

#include <algorithm>

#include "engine/output/encode.h"

namespace penumbra::jobs {

namespace {

constexpr auto preview_lifetime = std::chrono::milliseconds(250);

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

}  // namespace

SharedRender::SharedRender(std::string spec_hash, std::unique_ptr<api::JobRequest> request, std::size_t body_bytes)
    : spec_hash_(std::move(spec_hash)),
      body_bytes_(body_bytes),
      memory_bytes_(request ? api::estimate_cost(*request).memory_bytes : 0),
      time_budget_s_(request ? request->options.time_budget_s.value_or(0) : 0),
      request_(std::move(request)) {}

void SharedRender::start(int width, int height) {
  const std::lock_guard lock(mutex_);
  started_ = Clock::now();
  width_ = width, height_ = height;
}

void SharedRender::ask_to_stop(StopReason reason) {
  {
    const std::lock_guard lock(mutex_);
    if (!stop_reason_) stop_reason_ = reason;
  }
  control.cancel();
}

std::optional<StopReason> SharedRender::stop_reason() const {
  const std::lock_guard lock(mutex_);
  return stop_reason_;
}

double SharedRender::running_s() const {
  const std::lock_guard lock(mutex_);
  return started_ ? seconds_since(*started_) : 0;
}

std::optional<double> SharedRender::eta_s() const {
  const double percent = control.percent();
  const double elapsed_s = running_s();
  std::optional<double> left_s;
  // The first tiles say little about the rest.
  if (percent >= 1) left_s = elapsed_s * (100 - percent) / percent;
  if (time_budget_s_ > 0) {
    const double budget_left_s = std::max(0.0, time_budget_s_ - elapsed_s);
    left_s = std::min(left_s.value_or(budget_left_s), budget_left_s);
  }
  return left_s;
}

std::shared_ptr<const std::string> SharedRender::preview() const {
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

}  // namespace penumbra::jobs
