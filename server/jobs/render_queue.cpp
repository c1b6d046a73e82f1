#include "server/jobs/render_queue.h"

#include <algorithm>
#include <utility>

namespace penumbra::jobs {

SharedRender::QueueKey RenderQueue::key_of(const SharedRender& render) {
  const auto first = std::max_element(render.jobs.begin(), render.jobs.end(),
                                      [](const auto& a, const auto& b) { return a->priority() < b->priority(); });
  const auto oldest = std::min_element(render.jobs.begin(), render.jobs.end(),
                                       [](const auto& a, const auto& b) { return a->id() < b->id(); });
  return {-(*first)->priority(), (*oldest)->id()};
}

void RenderQueue::attach(const std::shared_ptr<LiveJob>& job, const std::string& spec_hash,
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
  bytes_ += body_bytes;
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

bool RenderQueue::detach(LiveJob& job) {
  const std::shared_ptr<SharedRender> render = job.render;
  if (!render) return false;
  const auto place =
      std::find_if(render->jobs.begin(), render->jobs.end(), [&](const auto& other) { return other.get() == &job; });
  if (place == render->jobs.end()) return false;
  if (render->jobs.size() > 1) {
    render->jobs.erase(place);
    if (!render->is_running) place_again(render);
    return true;
  }
  forbid_joining(*render);
  if (render->is_running) {
    render->ask_to_stop(StopReason::canceled);
    return false;
  }
  queue_.erase(render->key);
  bytes_ -= render->body_bytes();
  render->jobs.clear();
  return true;
}

std::shared_ptr<SharedRender> RenderQueue::take_next() {
  if (queue_.empty()) return nullptr;
  std::shared_ptr<SharedRender> next = std::move(queue_.begin()->second);
  queue_.erase(queue_.begin());
  bytes_ -= next->body_bytes();
  next->is_running = true;
  return next;
}

std::vector<std::shared_ptr<LiveJob>> RenderQueue::close(SharedRender& render) {
  forbid_joining(render);
  return std::exchange(render.jobs, {});
}

std::size_t RenderQueue::waiting_jobs() const {
  std::size_t count = 0;
  for (const auto& [key, render] : queue_) count += render->jobs.size();
  return count;
}

std::unordered_map<const SharedRender*, std::int64_t> RenderQueue::positions() const {
  std::unordered_map<const SharedRender*, std::int64_t> positions;
  for (const auto& [key, render] : queue_)
    positions.emplace(render.get(), static_cast<std::int64_t>(positions.size()) + 1);
  return positions;
}

std::optional<std::int64_t> RenderQueue::position(const LiveJob& job) const {
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
