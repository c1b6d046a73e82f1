// The part of the manager that takes jobs in.
#include <chrono>
#include <utility>

#include "server/jobs/endings.h"
#include "server/jobs/job_manager.h"
#include "server/jobs/spec_hash.h"
#include "server/store/sha256.h"

namespace penumbra::jobs {

using std::chrono::system_clock;

namespace {

/// All but the id.
store::JobRecord record_of(const api::JobRequest& request, const Submitter& submitter) {
  store::JobRecord record;
  record.owner = submitter.owner;
  record.created_at = system_clock::now();
  record.spec_hash = spec_hash(request);
  record.priority = request.options.priority;
  record.progress_interval_s = request.options.progress_interval_s;
  record.is_awaited = submitter.is_waiting;
  record.name = request.scene.name;
  record.shape = api::ImageShape{request.options.width, request.options.height, request.options.format};
  return record;
}

}  // namespace

std::optional<Submission> JobManager::repeated(const store::IdempotencyKey& key) {
  while (const std::optional<store::Created> created = store_.find_key(key)) {
    if (created->outcome == store::Created::Outcome::conflict)
      return Submission{Submission::Outcome::key_conflict, {}, 1, nullptr};
    HeldJobs::Hold hold = held_.hold(created->job.id);
    std::optional<api::JobResource> job = find(created->job.id);
    // Retention may have been quicker: then the key is free.
    if (!job) continue;
    claim(created->job.id);
    return Submission{Submission::Outcome::repeated, std::move(*job), 1, std::move(hold)};
  }
  return std::nullopt;
}

std::variant<std::shared_ptr<LiveJob>, Submission> JobManager::admit(store::JobRecord record, std::size_t body_bytes,
                                                                     const Submitter& submitter) {
  const std::lock_guard lock(mutex_);
  if (!is_accepting_) return Submission{Submission::Outcome::stopping, {}, 1, nullptr};
  const auto places = static_cast<std::size_t>(settings_.jobs) + settings_.max_queued;
  const std::optional<std::size_t> waiting_bytes = queue_.waiting_bytes();
  if (live_.size() >= places || (waiting_bytes && *waiting_bytes + body_bytes > settings_.max_queued_bytes)) {
    ++totals_.refused;
    return Submission{Submission::Outcome::queue_full, {}, retry_after_s(), nullptr};
  }
  const auto own = live_of_.find(submitter.owner);
  if (submitter.max_jobs && own != live_of_.end() && own->second >= *submitter.max_jobs) {
    ++totals_.refused;
    return Submission{Submission::Outcome::owner_full, {}, retry_after_s(), nullptr};
  }
  record.id = ids_.next(record.created_at);
  const auto job = std::make_shared<LiveJob>(std::move(record));
  // Known before it is stored, so that no call can find it and yet not stop it.
  add_live(job);
  return job;
}

Submission JobManager::submit(std::string body, const std::optional<std::string>& idempotency_key,
                              const Submitter& submitter) {
  auto request = std::make_unique<api::JobRequest>(api::parse_job(body, settings_.limits));
  std::optional<store::IdempotencyKey> key;
  std::optional<Turns::Turn> turn;
  if (idempotency_key) {
    key = store::IdempotencyKey{*idempotency_key, store::sha256_hex(body), submitter.owner};
    // Calls with one key come one after the other: what the first has made answers the others, even when the queue is
    // full.
    turn.emplace(key_turns_, Turns::Name{submitter.owner, *idempotency_key});
    if (std::optional<Submission> submission = repeated(*key)) return std::move(*submission);
  }

  store::JobRecord record = record_of(*request, submitter);
  const std::size_t body_bytes = body.size();
  auto admitted = admit(record, body_bytes, submitter);
  if (auto* refusal = std::get_if<Submission>(&admitted)) return std::move(*refusal);
  const std::shared_ptr<LiveJob> job = std::get<std::shared_ptr<LiveJob>>(admitted);
  record.id = job->id();
  HeldJobs::Hold hold = held_.hold(record.id);
  const auto forget = [&] {
    const std::lock_guard lock(mutex_);
    drop_live(record.id);
  };
  store::Created created;
  try {
    created = store_.create(record, std::move(body), key);
  } catch (const store::StorageFull&) {
    forget();
    return {Submission::Outcome::storage_full, {}, 1, nullptr};
  } catch (const store::StoreFailed&) {
    forget();
    return {Submission::Outcome::stopping, {}, 1, nullptr};
  } catch (...) {
    forget();
    throw;
  }
  if (created.outcome != store::Created::Outcome::created) {
    // Another server of this store was quicker.
    forget();
    return repeated(*key).value_or(Submission{Submission::Outcome::stopping, {}, 1, nullptr});
  }
  Submission submission = enter(job, created.job, std::move(request), body_bytes);
  submission.hold = std::move(hold);
  return submission;
}

Submission JobManager::enter(const std::shared_ptr<LiveJob>& job, const store::JobRecord& stored,
                             std::unique_ptr<api::JobRequest> request, std::size_t body_bytes) {
  Submission submission{Submission::Outcome::accepted, resource_of(stored), 1, nullptr};
  const bool has_image = stored.state == api::JobState::succeeded;  // that of an equal job
  {
    const std::lock_guard lock(mutex_);
    ++totals_.accepted;
    if (has_image) {
      ++totals_.succeeded;
      drop_live(job->id());
    }
  }
  if (has_image) return submission;
  switch (queue_.attach(job, stored.spec_hash, std::move(request), body_bytes)) {
    case RenderQueue::Entry::waits:
      submission.job.queue_position = queue_.position(*job);
      break;
    case RenderQueue::Entry::runs:
      start(*job, queue_.render_of(*job));
      break;
    case RenderQueue::Entry::is_canceled:
      end(*job, stopped(StopReason::canceled, 0));
      break;
    case RenderQueue::Entry::is_closed:
      leave(*job);
  }
  return submission;
}

}  // namespace penumbra::jobs
