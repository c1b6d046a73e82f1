#include "server/jobs/render_queue.h"

#include <algorithm>
#include <utility>

namespace penumbra::jobs {

namespace {

SharedRender::QueueKey key_of(const SharedRender& render) {
  const auto first = std::max_element(render.jobs.begin(), render.jobs.end(),
                                      [](const auto& a, const auto& b) { return a->priority() < b->priority(); });
  const auto oldest = std::min_element(render.jobs.begin(), render.jobs.end(),
                                       [](const auto& a, const auto& b) { return a->id() < b->id(); });
  return {-(*first)->priority(), (*oldest)->id()};
}

}  // namespace

RenderQueue::Entry RenderQueue::attach(const std::shared_ptr<LiveJob>& job, const std::string& spec_hash,
                                       std::unique_ptr<api::JobRequest> request, std::size_t body_bytes) {
  const std::lock_guard lock(mutex_);
  if (job->is_cancel_asked) return Entry::is_canceled;
  if (is_closed_) return Entry::is_closed;
  enter(job, spec_hash, std::move(request), body_bytes);
  changed_.notify_all();
  return job->render->is_running ? Entry::runs : Entry::waits;
}

bool RenderQueue::attach_again(const std::shared_ptr<LiveJob>& job, const std::string& spec_hash) {
  const std::lock_guard lock(mutex_);
  job->is_cancel_asked = false;
  if (is_closed_) return false;
  enter(job, spec_hash, nullptr, 0);
  changed_.notify_all();
  return true;
}

void RenderQueue::enter(const std::shared_ptr<LiveJob>& job, const std::string& spec_hash,
                        std::unique_ptr<api::JobRequest> request, std::size_t body_bytes) {
  const auto equal = spec_hash.empty() ? by_hash_.end() : by_hash_.find(spec_hash);
  if (equal != by_hash_.end()) {
    job->render = equal->second;
    job->render->jobs.push_back(job);
    if (!job->render->is_running) place_again(job->render);
    return;
  }
  const auto render = std::make_shared<SharedRender>(spec_hash, std::move(request), body_bytes);
  render->jobs.push_back(job);
  render->key = key_of(*render);
  if (!spec_hash.empty()) by_hash_.emplace(spec_hash, render);
  queue_.emplace(render->key, render);
  waiting_bytes_ += body_bytes;
  job->render = render;
}

void RenderQueue::place_again(const std::shared_ptr<SharedRender>& render) {
  queue_.erase(render->key);
  render->key = key_of(*render);
  queue_.emplace(render->key, render);
}

void RenderQueue::forbid_joining(const SharedRender& render) {
  const auto found = by_hash_.find(render.spec_hash());
  // Another render of the same hash may have come since.
  if (found != by_hash_.end() && found->second.get() == &render) by_hash_.erase(found);
}

RenderQueue::Cancel RenderQueue::cancel(LiveJob& job) {
  const std::lock_guard lock(mutex_);
  job.is_cancel_asked = true;
  const std::shared_ptr<SharedRender> render = job.render;
  if (!render) return Cancel::is_noted;
  const auto place =
      std::find_if(render->jobs.begin(), render->jobs.end(), [&](const auto& other) { return other.get() == &job; });
  if (place == render->jobs.end()) return Cancel::is_too_late;
  // What waited behind it may fit, and a render that waits for room is to go on.
  changed_.notify_all();
  if (render->jobs.size() > 1) {
    render->jobs.erase(place);
    if (!render->is_running) place_again(render);
    return Cancel::is_yours;
  }
  forbid_joining(*render);
  if (render->is_running) {
    render->ask_to_stop(StopReason::canceled);
    return Cancel::is_stopping;
  }
  queue_.erase(render->key);
  waiting_bytes_ -= render->body_bytes();
  render->jobs.clear();
  return Cancel::is_yours;
}

bool RenderQueue::is_to_be_canceled(const LiveJob& job) const {
  const std::lock_guard lock(mutex_);
  return job.is_cancel_asked;
}

bool RenderQueue::has_room(std::size_t bytes) const {
  return running_bytes_ == 0 || (bytes <= max_running_bytes_ && running_bytes_ <= max_running_bytes_ - bytes);
}

std::shared_ptr<SharedRender> RenderQueue::take_first() {
  std::shared_ptr<SharedRender> first = std::move(queue_.begin()->second);
  queue_.erase(queue_.begin());
  waiting_bytes_ -= first->body_bytes();
  first->is_running = true;
  return first;
}

std::shared_ptr<SharedRender> RenderQueue::take_next(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  // The first waits for room rather than being passed by smaller ones for ever.
  const auto may_take = [&] {
    return !queue_.empty() && !unmeasured_ && has_room(queue_.begin()->second->memory_bytes());
  };
  if (!changed_.wait(lock, stop, may_take)) return nullptr;
  std::shared_ptr<SharedRender> next = take_first();
  // Nobody is taken after one whose need is not known before it is, or those after it would get ahead of it.
  if (next->memory_bytes() == 0) unmeasured_ = next;
  next->held_bytes = next->memory_bytes();
  running_bytes_ += next->held_bytes;
  running_.emplace(next.get(), next);
  return next;
}

void RenderQueue::wait_for_room(SharedRender& render, std::size_t bytes) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return has_room(bytes) || render.stop_reason(); });
  unmeasured_.reset();
  render.held_bytes = bytes;
  running_bytes_ += bytes;
  changed_.notify_all();
}

std::vector<std::shared_ptr<LiveJob>> RenderQueue::jobs_of(const SharedRender& render) const {
  const std::lock_guard lock(mutex_);
  return render.jobs;
}

std::vector<RenderQueue::Ended> RenderQueue::finish(SharedRender& render) {
  const std::lock_guard lock(mutex_);
  forbid_joining(render);
  std::vector<Ended> ended;
  for (std::shared_ptr<LiveJob>& job : std::exchange(render.jobs, {})) {
    const bool is_cancel_asked = job->is_cancel_asked;
    ended.push_back({std::move(job), is_cancel_asked});
  }
  if (unmeasured_.get() == &render) unmeasured_.reset();
  running_bytes_ -= render.held_bytes;
  running_.erase(&render);
  changed_.notify_all();
  return ended;
}

void RenderQueue::stop_overdue(double time_limit_s) {
  const std::lock_guard lock(mutex_);
  for (const auto& [key, render] : running_) {
    if (render->running_s() > time_limit_s) render->ask_to_stop(StopReason::out_of_time);
  }
}

std::vector<std::shared_ptr<LiveJob>> RenderQueue::close() {
  const std::lock_guard lock(mutex_);
  is_closed_ = true;
  std::vector<std::shared_ptr<LiveJob>> waiting;
  while (!queue_.empty()) {
    const std::shared_ptr<SharedRender> render = take_first();
    forbid_joining(*render);
    for (auto& job : std::exchange(render->jobs, {})) waiting.push_back(std::move(job));
  }
  for (const auto& [key, render] : running_) render->ask_to_stop(StopReason::server_stopped);
  changed_.notify_all();
  return waiting;
}

RenderQueue::Counts RenderQueue::counts() const {
  const std::lock_guard lock(mutex_);
  Counts counts;
  for (const auto& [key, render] : queue_) counts.waiting_jobs += render->jobs.size();
  for (const auto& [key, render] : running_) counts.running_jobs += render->jobs.size();
  counts.running_renders = running_.size();
  return counts;
}

std::optional<std::size_t> RenderQueue::waiting_bytes() const {
  const std::lock_guard lock(mutex_);
  return queue_.empty() ? std::nullopt : std::optional(waiting_bytes_);
}

std::shared_ptr<SharedRender> RenderQueue::render_of(const LiveJob& job) const {
  const std::lock_guard lock(mutex_);
  return job.render;
}

std::unordered_map<const LiveJob*, std::int64_t> RenderQueue::positions() const {
  const std::lock_guard lock(mutex_);
  std::unordered_map<const LiveJob*, std::int64_t> positions;
  std::int64_t place = 0;
  for (const auto& [key, render] : queue_) {
    ++place;
    for (const std::shared_ptr<LiveJob>& job : render->jobs) positions.emplace(job.get(), place);
  }
  return positions;
}

std::optional<std::int64_t> RenderQueue::position(const LiveJob& job) const {
  const std::lock_guard lock(mutex_);
  if (!job.render || job.render->is_running) return std::nullopt;
  const auto place = queue_.find(job.render->key);
  if (place == queue_.end() || place->second != job.render) return std::nullopt;
  // From both ends at once: the jobs that ask most are the newest and the next.
  auto front = queue_.begin(), back = queue_.end();
  for (std::int64_t steps = 1;; ++steps, ++front) {
    if (front == place) return steps;
    if (--back == place) return static_cast<std::int64_t>(queue_.size()) - steps + 1;
  }
}

}  // namespace penumbra::jobs
