#include "server/jobs/job_manager.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "server/jobs/endings.h"
#include "server/jobs/spec_hash.h"
#include "server/store/sha256.h"

namespace penumbra::jobs {

using std::chrono::system_clock;

JobManager::JobManager(const Settings& settings, store::JobStore& store, render::Pool& pool)
    : settings_(settings), store_(store), pool_(pool), ids_(store.newest_id()) {
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
    const auto job = std::make_shared<LiveJob>(std::move(record));
    add_live(job);
    queue_.attach(job, spec_hash, nullptr, 0);
  }
  spdlog::debug("{} unfinished jobs, {} at once", live_.size(), settings_.jobs);
}

Submission JobManager::submit(std::string body, const std::optional<std::string>& idempotency_key,
                              const Submitter& submitter) {
  auto request = std::make_unique<api::JobRequest>(api::parse_job(body, settings_.limits));
  std::optional<store::IdempotencyKey> key;
  if (idempotency_key) key = store::IdempotencyKey{*idempotency_key, store::sha256_hex(body), submitter.owner};
  const auto answer_of = [&](const store::Created& created) {
    const bool is_conflict = created.outcome == store::Created::Outcome::conflict;
    if (!is_conflict) claim(created.job.id);
    return Submission{is_conflict ? Submission::Outcome::key_conflict : Submission::Outcome::repeated,
                      find(created.job.id).value_or(resource_of(created.job)), 1};
  };
  // A repeated call is answered even when the queue is full.
  if (key) {
    if (const std::optional<store::Created> created = store_.find_key(*key)) return answer_of(*created);
  }

  store::JobRecord record;
  record.owner = submitter.owner;
  record.created_at = system_clock::now();
  record.spec_hash = spec_hash(*request);
  record.priority = request->options.priority;
  record.progress_interval_s = request->options.progress_interval_s;
  const std::size_t body_bytes = body.size();
  std::shared_ptr<LiveJob> job;
  {
    const std::lock_guard lock(mutex_);
    if (!is_accepting_) return {Submission::Outcome::stopping, {}, 1};
    const auto places = static_cast<std::size_t>(settings_.jobs) + settings_.max_queued;
    if (live_.size() >= places || (!queue_.is_empty() && queue_.bytes() + body_bytes > settings_.max_queued_bytes)) {
      ++totals_.refused;
      return {Submission::Outcome::queue_full, {}, retry_after_s()};
    }
    const auto own = live_of_.find(submitter.owner);
    if (submitter.max_jobs && own != live_of_.end() && own->second >= *submitter.max_jobs) {
      ++totals_.refused;
      return {Submission::Outcome::owner_full, {}, retry_after_s()};
    }
    record.id = ids_.next(record.created_at);
    job = std::make_shared<LiveJob>(record);
    // Known before it is stored, so that no call can find it and yet not stop it.
    add_live(job);
  }
  const auto forget = [&] {
    const std::lock_guard lock(mutex_);
    drop_live(record.id);
  };
  store::Created created;
  try {
    created = store_.create(record, std::move(body), key);
  } catch (const store::StorageFull&) {
    forget();
    return {Submission::Outcome::storage_full, {}, 1};
  } catch (const store::StoreFailed&) {
    forget();
    return {Submission::Outcome::stopping, {}, 1};
  } catch (...) {
    forget();
    throw;
  }
  if (created.outcome != store::Created::Outcome::created) {
    forget();
    return answer_of(created);
  }
  return enter(job, created.job, std::move(request), body_bytes);
}

Submission JobManager::enter(const std::shared_ptr<LiveJob>& job, const store::JobRecord& stored,
                             std::unique_ptr<api::JobRequest> request, std::size_t body_bytes) {
  std::shared_ptr<SharedRender> running;
  Submission submission{Submission::Outcome::accepted, resource_of(stored), 1};
  std::unique_lock lock(mutex_);
  ++totals_.accepted;
  if (stored.state == api::JobState::succeeded) {
    // An equal job's image was there.
    ++totals_.succeeded;
    drop_live(job->id());
  } else if (job->is_cancel_asked) {
    lock.unlock();
    end(*job, stopped(StopReason::canceled, 0));
  } else if (is_stopping_) {
    drop_live(job->id());
    job->leave();
  } else {
    queue_.attach(job, stored.spec_hash, std::move(request), body_bytes);
    submission.job.queue_position = queue_.position(*job);
    if (job->render->is_running) running = job->render;
    work_available_.notify_one();
  }
  if (lock) lock.unlock();
  if (running) start(*job, running);
  return submission;
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
      const auto position = positions.find(live->second->render.get());
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
    bool is_mine = false, is_ending = false;
    {
      const std::lock_guard lock(mutex_);
      job->is_cancel_asked = true;
      is_mine = queue_.detach(*job);
      is_ending = !is_mine && job->render && job->render->jobs.empty();
    }
    if (is_mine) {
      // What waited behind it may fit.
      work_available_.notify_all();
      end_waiting(job);
    } else if (is_ending) {
      // Too late: how it ends is decided, and about to be stored.
      constexpr auto longest = std::chrono::seconds(10);
      job->wait_until_final(Clock::now() + longest);
    }
  }
  cancel_left(id);
  return find(id);
}

void JobManager::end_waiting(const std::shared_ptr<LiveJob>& job) {
  try {
    return end(*job, stopped(StopReason::canceled, 0), WhenFull::fail);
  } catch (const store::StorageFull&) {
    const std::optional<store::JobRecord> record = store_.find(job->id());
    bool is_back = false;
    {
      const std::lock_guard lock(mutex_);
      job->is_cancel_asked = false;
      is_back = record && !is_stopping_;
      if (is_back) queue_.attach(job, record->spec_hash, nullptr, 0);
    }
    work_available_.notify_all();
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

std::optional<Preview> JobManager::preview(const std::string& id) const {
  std::shared_ptr<SharedRender> render;
  bool is_live = false;
  {
    const std::lock_guard lock(mutex_);
    const auto job = live_.find(id);
    is_live = job != live_.end();
    if (is_live) render = job->second->render;
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
  std::vector<std::shared_ptr<LiveJob>> waiting;
  {
    const std::lock_guard lock(mutex_);
    is_accepting_ = false;
    is_stopping_ = true;
    while (const std::shared_ptr<SharedRender> render = queue_.take_next()) {
      for (auto& job : queue_.close(*render)) waiting.push_back(std::move(job));
    }
    for (const auto& [key, render] : running_) render->ask_to_stop(StopReason::server_stopped);
  }
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
  counts.queued = queue_.waiting_jobs();
  for (const auto& [key, render] : running_) counts.running += render->jobs.size();
  counts.renders = running_.size();
  counts.max_queued = settings_.max_queued;
  return counts;
}

}  // namespace penumbra::jobs
