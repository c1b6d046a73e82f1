#include "tests/support/memory_store.h"

#include <algorithm>
#include <utility>

#include "server/store/sha256.h"

namespace penumbra::test {

namespace {

std::size_t size_of(const Image& image) {
  std::size_t size = 0;
  for (const auto& bytes : {image.bytes, image.png_preview, image.thumbnail}) size += bytes ? bytes->size() : 0;
  return size;
}

}  // namespace

std::optional<Created> MemoryStore::use_of(const IdempotencyKey& key) const {
  const auto use = keys_.find({key.owner, key.key});
  if (use == keys_.end()) return std::nullopt;
  const JobRecord& job = entries_.at(use->second.id).job;
  if (job.state == JobState::canceled) return std::nullopt;
  if (use->second.body_sha256 != key.body_sha256) return Created{Created::Outcome::conflict, job};
  return Created{Created::Outcome::repeated, job};
}

Created MemoryStore::create(const JobRecord& job, std::string spec, const std::optional<IdempotencyKey>& key) {
  const std::lock_guard lock(mutex_);
  KeyName name;
  if (key) {
    if (std::optional<Created> use = use_of(*key)) return std::move(*use);
    name = {key->owner, key->key};
    keys_[name] = {key->body_sha256, job.id};
  }
  spec_bytes_ += spec.size();
  Entry entry{job, std::move(spec), name, {}};
  for (const auto& [id, other] : entries_) {
    if (job.spec_hash.empty() || other.job.spec_hash != job.spec_hash) continue;
    if (other.found.state != ImageState::present) continue;
    entry.job.state = JobState::succeeded;
    entry.job.percent = 100;
    entry.job.started_at = job.created_at;
    entry.job.finished_at = not_before_others(job.created_at);
    entry.job.stats = other.job.stats;
    keep_image(entry, other.found.image);
    ++finished_jobs_;
    break;
  }
  return {Created::Outcome::created, entries_.emplace(job.id, std::move(entry)).first->second.job};
}

std::optional<Created> MemoryStore::find_key(const IdempotencyKey& key) const {
  const std::lock_guard lock(mutex_);
  return use_of(key);
}

void MemoryStore::free_key(const std::string& id) {
  const std::lock_guard lock(mutex_);
  std::erase_if(keys_, [&](const auto& use) { return use.second.id == id; });
}

bool MemoryStore::start(const std::string& id, Time started_at) {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end() || entry->second.job.state != JobState::queued) return false;
  entry->second.job.state = JobState::running;
  entry->second.job.started_at = started_at;
  return true;
}

bool MemoryStore::put_back(const std::string& id, double percent) {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end() || entry->second.job.state != JobState::running) return false;
  entry->second.job.state = JobState::queued;
  entry->second.job.started_at.reset();
  entry->second.job.percent = percent;
  return true;
}

bool MemoryStore::finish(const std::string& id, Ending ending) {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(id);
  if (found == entries_.end() || api::is_final(found->second.job.state)) return false;
  Entry& entry = found->second;
  entry.job.state = ending.state;
  entry.job.percent = ending.percent;
  entry.job.finished_at = not_before_others(ending.finished_at);
  entry.job.error = std::move(ending.error);
  entry.job.stats = std::move(ending.stats);
  if (ending.image) keep_image(entry, std::move(*ending.image));
  ++finished_jobs_;
  return true;
}

Time MemoryStore::not_before_others(Time end) const {
  for (const auto& [id, entry] : entries_) end = std::max(end, entry.job.finished_at.value_or(end));
  return end;
}

void MemoryStore::keep_image(Entry& entry, Image image) {
  KeptImage& kept = images_[image.sha256];
  if (kept.jobs++ == 0) image_bytes_ += kept.bytes = size_of(image);
  entry.job.size_bytes = image.bytes->size();
  entry.found = {ImageState::present, std::move(image)};
}

void MemoryStore::drop_spec(Entry& entry) {
  if (!entry.spec) return;
  spec_bytes_ -= entry.spec->size();
  entry.spec.reset();
}

void MemoryStore::drop_image(Entry& entry) {
  if (entry.found.state != ImageState::present) return;
  const auto kept = images_.find(entry.found.image.sha256);
  if (--kept->second.jobs == 0) {
    image_bytes_ -= kept->second.bytes;
    images_.erase(kept);
  }
  entry.found = {ImageState::expired, {}};
  entry.job.size_bytes.reset();
}

void MemoryStore::erase(Entries::iterator entry) {
  drop_image(entry->second);
  drop_spec(entry->second);
  if (api::is_final(entry->second.job.state)) --finished_jobs_;
  const auto use = keys_.find(entry->second.key);
  // A key that was free again may by now belong to a later job.
  if (use != keys_.end() && use->second.id == entry->first) keys_.erase(use);
  entries_.erase(entry);
}

bool MemoryStore::remove(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end()) return false;
  erase(entry);
  return true;
}

std::optional<JobRecord> MemoryStore::find(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end()) return std::nullopt;
  return entry->second.job;
}

std::optional<std::string> MemoryStore::spec(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end()) return std::nullopt;
  return entry->second.spec;
}

std::optional<FoundImage> MemoryStore::image(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(id);
  if (entry == entries_.end()) return std::nullopt;
  return entry->second.found;
}

std::optional<FoundImage> MemoryStore::thumbnail(const std::string& id) const {
  std::optional<FoundImage> found = image(id);
  if (!found) return std::nullopt;
  found->image = {found->image.thumbnail, "image/png", "", nullptr, nullptr};
  if (found->image.bytes) found->image.sha256 = sha256_hex(*found->image.bytes);
  return found;
}

Page MemoryStore::list(const Filter& filter, std::size_t limit, const std::optional<std::string>& page_token) const {
  const std::lock_guard lock(mutex_);
  Page page;
  // The token is the id of the last job of the page before; what is newer has been seen.
  auto entry = page_token ? entries_.lower_bound(*page_token) : entries_.end();
  while (entry != entries_.begin()) {
    --entry;
    const JobRecord& job = entry->second.job;
    if (filter.state && job.state != *filter.state) continue;
    if (filter.owner && job.owner != *filter.owner) continue;
    if (page.jobs.size() == limit) {
      page.next_page_token = page.jobs.back().id;
      break;
    }
    page.jobs.push_back(job);
  }
  return page;
}

std::vector<JobRecord> MemoryStore::unfinished() const {
  const std::lock_guard lock(mutex_);
  std::vector<JobRecord> jobs;
  for (const auto& [id, entry] : entries_) {
    if (!api::is_final(entry.job.state)) jobs.push_back(entry.job);
  }
  return jobs;
}

std::string MemoryStore::newest_id() const {
  const std::lock_guard lock(mutex_);
  return entries_.empty() ? "" : entries_.rbegin()->first;
}

void MemoryStore::expire(const Retention& retention, Time now) {
  const std::lock_guard lock(mutex_);
  std::vector<std::pair<Time, std::string>> ended;
  for (const auto& [id, entry] : entries_) {
    if (entry.job.finished_at && !retention.is_held(id)) ended.emplace_back(*entry.job.finished_at, id);
  }
  std::ranges::sort(ended);
  for (const auto& [end, id] : ended) {
    if (now - end > retention.image_age) drop_image(entries_.at(id));
  }
  for (const auto& [end, id] : ended) {
    if (image_bytes_ > retention.max_image_bytes) drop_image(entries_.at(id));
  }
  for (const auto& [end, id] : ended) {
    if (spec_bytes_ > retention.max_spec_bytes) drop_spec(entries_.at(id));
  }
  for (const auto& [end, id] : ended) {
    if (now - end > retention.job_age) erase(entries_.find(id));
  }
  for (const auto& [end, id] : ended) {
    const auto entry = entries_.find(id);
    if (entry != entries_.end() && finished_jobs_ > retention.max_jobs) erase(entry);
  }
}

}  // namespace penumbra::test
