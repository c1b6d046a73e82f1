#include "server/jobs/job_manager.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "engine/output/encode.h"
#include "engine/output/thumbnail.h"
#include "server/jobs/endings.h"
#include "server/store/sha256.h"

namespace penumbra::jobs {

using std::chrono::system_clock;

namespace {

store::Retention retention_without(const HeldJobs& held, store::Retention retention) {
  retention.is_held = [&held](const std::string& id) { return held.is_held(id); };
  return retention;
}

}  // namespace

JobManager::JobManager(const Settings& settings, store::JobStore& store, system::Pool& pool)
    : settings_(settings),
      store_(store),
      pool_(pool),
      ids_(store.newest_id()),
      retention_(retention_without(held_, settings.retention)),
      retention_clock_(system_clock::now(), Clock::now()),
      queue_(settings.max_running_bytes) {
  recover();
  for (int i = 0; i < std::max(1, settings_.jobs); ++i)
    runners_.emplace_back([this](const std::stop_token& stop) { run_jobs(stop); });
  timekeeper_ = std::jthread([this](const std::stop_token& stop) { keep_time(stop); });
}

JobManager::~JobManager() { stop(); }

void JobManager::recover() {
  const std::lock_guard lock(mutex_);
  for (store::JobRecord& record : store_.unfinished()) {
    const std::string spec_hash = record.spec_hash;
    const bool is_awaited = record.is_awaited;
    const auto job = std::make_shared<LiveJob>(std::move(record));
    // Those who waited for it are gone.
    if (is_awaited) job->claims = 0;
    add_live(job);
    queue_.attach(job, spec_hash, nullptr, 0);
  }
  spdlog::debug("{} unfinished jobs, {} at once", live_.size(), settings_.jobs);
}

void JobManager::add_live(const std::shared_ptr<LiveJob>& job) {
  live_.emplace(job->id(), job);
  ++live_of_[job->owner()];
}

void JobManager::drop_live(const std::string& id) {
  const auto job = live_.find(id);
  if (job == live_.end()) return;
  const auto own = live_of_.find(job->second->owner());
  if (--own->second == 0) live_of_.erase(own);
  live_.erase(job);
}

std::optional<std::string> JobManager::owner_of(const std::string& id) const {
  if (const std::shared_ptr<LiveJob> job = find_live(id)) return job->owner();
  const std::optional<store::JobRecord> record = store_.find(id);
  if (!record) return std::nullopt;
  return record->owner;
}

std::shared_ptr<LiveJob> JobManager::find_live(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto job = live_.find(id);
  return job == live_.end() ? nullptr : job->second;
}

std::optional<api::JobResource> JobManager::find(const std::string& id) const {
  {
    const std::lock_guard lock(mutex_);
    const auto job = live_.find(id);
    if (job != live_.end()) {
      api::JobResource resource = job->second->resource();
      resource.queue_position = queue_.position(*job->second);
      return resource;
    }
  }
  const std::optional<store::JobRecord> record = store_.find(id);
  if (!record) return std::nullopt;
  return resource_of(*record);
}

std::optional<api::JobResource> JobManager::wait(const std::string& id, Clock::time_point deadline) const {
  if (const std::shared_ptr<LiveJob> job = find_live(id)) {
    job->wait_until_final(deadline);
    const api::JobResource resource = job->resource();
    // A job that was removed has ended too: its watchers hear that.
    if (api::is_final(resource.state)) return resource;
  }
  return find(id);
}

JobList JobManager::list(const store::Filter& filter, std::size_t limit,
                         const std::optional<std::string>& page_token) const {
  store::Page page = store_.list(filter, limit, page_token);
  JobList list;
  list.next_page_token = std::move(page.next_page_token);
  const std::lock_guard lock(mutex_);
  const auto positions = queue_.positions();
  for (const store::JobRecord& record : page.jobs) {
    const auto live = live_.find(record.id);
    const bool is_live = live != live_.end() && live->second->resource().state == record.state;
    api::JobResource resource = is_live ? live->second->resource() : resource_of(record);
    if (is_live) {
      const auto position = positions.find(live->second.get());
      if (position != positions.end()) resource.queue_position = position->second;
    }
    list.jobs.push_back(std::move(resource));
  }
  return list;
}

void JobManager::claim(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto job = live_.find(id);
  if (job != live_.end()) ++job->second->claims;
}

void JobManager::give_up(const std::string& id) {
  {
    const std::lock_guard lock(mutex_);
    const auto job = live_.find(id);
    if (job == live_.end() || --job->second->claims > 0) return;
  }
  cancel(id);
}

std::optional<api::JobResource> JobManager::cancel(const std::string& id) {
  if (const std::shared_ptr<LiveJob> job = find_live(id)) {
    switch (queue_.cancel(*job)) {
      case RenderQueue::Cancel::is_yours:
        end_waiting(job);
        break;
      case RenderQueue::Cancel::is_too_late: {
        // It is about to be stored.
        constexpr auto longest = std::chrono::seconds(10);
        job->wait_until_final(Clock::now() + longest);
        break;
      }
      case RenderQueue::Cancel::is_stopping:
      case RenderQueue::Cancel::is_noted:
        free_key(id);
    }
  }
  cancel_left(id);
  return find(id);
}

void JobManager::free_key(const std::string& id) {
  try {
    store_.free_key(id);
  } catch (const std::exception& error) {
    spdlog::error("job {}: its key is free only once it has ended: {}", id, error.what());
  }
}

void JobManager::end_waiting(const std::shared_ptr<LiveJob>& job) {
  try {
    return end(*job, stopped(StopReason::canceled, 0), WhenFull::fail);
  } catch (const store::StorageFull&) {
    const std::optional<store::JobRecord> record = store_.find(job->id());
    const bool is_back = record && queue_.attach_again(job, record->spec_hash);
    if (!is_back) leave(*job);
    throw;
  }
}

void JobManager::cancel_left(const std::string& id) {
  if (!is_stopping() || find_live(id)) return;
  const std::optional<store::JobRecord> record = store_.find(id);
  if (!record || api::is_final(record->state)) return;
  store::Ending ending = stopped(StopReason::canceled, 0);
  ending.percent = record->percent;
  ending.finished_at =
      std::max({system_clock::now(), record->created_at, record->started_at.value_or(record->created_at)});
  if (!store_.finish(id, ending)) return;
  const std::lock_guard lock(mutex_);
  ++totals_.canceled;
}

bool JobManager::remove(const std::string& id) {
  const std::shared_ptr<LiveJob> job = find_live(id);
  if (job) cancel(id);
  const bool is_removed = store_.remove(id);
  const std::lock_guard lock(mutex_);
  drop_live(id);
  return is_removed;
}

std::optional<store::FoundImage> JobManager::image(const std::string& id) const { return store_.image(id); }

std::optional<store::FoundImage> JobManager::thumbnail(const std::string& id) const {
  std::optional<store::FoundImage> found = store_.thumbnail(id);
  if (!found || found->state != store::ImageState::present || found->image.bytes) return found;
  // The image is small itself, or from before there were thumbnails.
  const std::optional<api::JobResource> job = this->find(id);
  found = store_.image(id);
  if (!job || !found || found->state != store::ImageState::present) return found;
  std::shared_ptr<const std::string> png = found->image.png_preview ? found->image.png_preview : found->image.bytes;
  if (!job->shape || std::max(job->shape->width, job->shape->height) > thumbnail_edge) {
    const render::Film film = output::decode_png(*png);
    png = std::make_shared<const std::string>(output::encode(output::thumbnail(film, thumbnail_edge), {}));
  }
  found->image = {png, "image/png", store::sha256_hex(*png), nullptr, nullptr};
  return found;
}

std::optional<Preview> JobManager::preview(const std::string& id) const {
  std::shared_ptr<SharedRender> render;
  bool is_live = false;
  {
    const std::lock_guard lock(mutex_);
    const auto job = live_.find(id);
    is_live = job != live_.end();
    if (is_live) render = queue_.render_of(*job->second);
  }
  if (is_live) {
    std::shared_ptr<const std::string> png = render ? render->preview() : nullptr;
    if (!png) return Preview{Preview::State::not_yet, nullptr};
    return Preview{Preview::State::present, std::move(png)};
  }
  const std::optional<store::FoundImage> found = store_.image(id);
  if (!found) return std::nullopt;
  if (found->state == store::ImageState::expired) return Preview{Preview::State::expired, nullptr};
  if (found->state == store::ImageState::none) return Preview{};
  return Preview{Preview::State::present, found->image.png_preview ? found->image.png_preview : found->image.bytes};
}

std::optional<double> JobManager::progress_interval_s(const std::string& id) const {
  const std::optional<store::JobRecord> record = store_.find(id);
  if (!record) return std::nullopt;
  return record->progress_interval_s;
}

bool JobManager::is_accepting() const {
  const std::lock_guard lock(mutex_);
  return is_accepting_;
}

void JobManager::stop_accepting() {
  const std::lock_guard lock(mutex_);
  is_accepting_ = false;
}

bool JobManager::is_stopping() const {
  const std::lock_guard lock(mutex_);
  return is_stopping_;
}

void JobManager::stop() {
  {
    const std::lock_guard lock(mutex_);
    is_accepting_ = false;
    is_stopping_ = true;
  }
  const std::vector<std::shared_ptr<LiveJob>> waiting = queue_.close();
  time_passes_.notify_all();
  for (const auto& job : waiting) leave(*job);
  for (std::jthread& runner : runners_) runner.request_stop();
  timekeeper_.request_stop();
  for (std::jthread& runner : runners_) {
    if (runner.joinable()) runner.join();
  }
  if (timekeeper_.joinable()) timekeeper_.join();
}

int JobManager::retry_after_s() const {
  constexpr double longest_s = 60;
  return static_cast<int>(std::clamp(std::ceil(average_s_ / std::max(1, settings_.jobs)), 1.0, longest_s));
}

Counts JobManager::counts() const {
  const std::lock_guard lock(mutex_);
  Counts counts = totals_;
  const RenderQueue::Counts queued = queue_.counts();
  counts.queued = queued.waiting_jobs;
  counts.running = queued.running_jobs;
  counts.renders = queued.running_renders;
  counts.max_queued = settings_.max_queued;
  return counts;
}

}  // namespace penumbra::jobs
