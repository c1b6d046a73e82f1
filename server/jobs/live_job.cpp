#include "server/jobs/live_job.h"

#include <algorithm>

namespace penumbra::jobs {

namespace {

constexpr double most_while_running = 99.99;  // 100 is for `succeeded` alone

}  // namespace

LiveJob::LiveJob(store::JobRecord record)
    : id_(record.id),
      owner_(record.owner),
      created_at_(record.created_at),
      priority_(record.priority),
      record_(std::move(record)) {}

bool LiveJob::start(api::Time now, std::shared_ptr<const SharedRender> shared) {
  const std::lock_guard lock(mutex_);
  if (is_left_) return false;
  if (record_.state != api::JobState::queued) return true;
  record_.state = api::JobState::running;
  record_.started_at = now;
  running_ = std::move(shared);
  return true;
}

void LiveJob::end(const store::Ending& ending) {
  {
    const std::lock_guard lock(mutex_);
    record_.state = ending.state;
    record_.percent = ending.percent;
    record_.finished_at = ending.finished_at;
    record_.error = ending.error;
    record_.stats = ending.stats;
    if (ending.image) record_.size_bytes = ending.image->bytes->size();
    running_.reset();
  }
  has_ended_.notify_all();
}

void LiveJob::leave() {
  {
    const std::lock_guard lock(mutex_);
    is_left_ = true;
  }
  has_ended_.notify_all();
}

api::Time LiveJob::not_before(api::Time now) const {
  const std::lock_guard lock(mutex_);
  return std::max({now, record_.created_at, record_.started_at.value_or(record_.created_at)});
}

api::JobResource LiveJob::resource() const {
  const std::lock_guard lock(mutex_);
  api::JobResource resource = resource_of(record_);
  if (record_.state != api::JobState::running) return resource;
  // What it had reached before a restart, or more.
  resource.percent = std::max(record_.percent, std::min(running_->control.percent(), most_while_running));
  resource.eta_s = running_->eta_s();
  return resource;
}

void LiveJob::wait_until_final(Clock::time_point deadline) const {
  std::unique_lock lock(mutex_);
  has_ended_.wait_until(lock, deadline, [&] { return is_left_ || api::is_final(record_.state); });
}

api::JobResource resource_of(const store::JobRecord& record) {
  // A record that gets another member no longer compiles here.
  [[maybe_unused]] const auto& [id, owner, spec_hash, state, priority, progress_interval_s, percent, crashes,
                                created_at, started_at, finished_at, error, stats, name, shape, size_bytes,
                                is_awaited] = record;
  return {id,          state, percent, std::nullopt, std::nullopt, created_at, started_at,
          finished_at, error, stats,   name,         shape,        size_bytes};
}

}  // namespace penumbra::jobs
