#include "server/store/timed_store.h"

#include <chrono>
#include <utility>

namespace penumbra::store {

namespace {

/// Reports at the end of its life, however the call ends.
class Stopwatch {
 public:
  Stopwatch(const TimedStore::Report& report, std::string_view operation) : report_(report), operation_(operation) {}
  ~Stopwatch() { report_(operation_, std::chrono::duration<double>(Clock::now() - start_).count()); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  const TimedStore::Report& report_;
  const std::string_view operation_;
  const Clock::time_point start_ = Clock::now();
};

}  // namespace

Created TimedStore::create(const JobRecord& job, std::string spec, const std::optional<IdempotencyKey>& key) {
  const Stopwatch stopwatch(report_, "create");
  return store_.create(job, std::move(spec), key);
}

std::optional<Created> TimedStore::find_key(const IdempotencyKey& key) const {
  const Stopwatch stopwatch(report_, "find_key");
  return store_.find_key(key);
}

void TimedStore::free_key(const std::string& id) {
  const Stopwatch stopwatch(report_, "free_key");
  store_.free_key(id);
}

bool TimedStore::start(const std::string& id, Time started_at) {
  const Stopwatch stopwatch(report_, "start");
  return store_.start(id, started_at);
}

bool TimedStore::put_back(const std::string& id, double percent) {
  const Stopwatch stopwatch(report_, "put_back");
  return store_.put_back(id, percent);
}

bool TimedStore::finish(const std::string& id, Ending ending) {
  const Stopwatch stopwatch(report_, "finish");
  return store_.finish(id, std::move(ending));
}

bool TimedStore::remove(const std::string& id) {
  const Stopwatch stopwatch(report_, "remove");
  return store_.remove(id);
}

std::optional<JobRecord> TimedStore::find(const std::string& id) const {
  const Stopwatch stopwatch(report_, "find");
  return store_.find(id);
}

std::optional<std::string> TimedStore::spec(const std::string& id) const {
  const Stopwatch stopwatch(report_, "spec");
  return store_.spec(id);
}

std::optional<FoundImage> TimedStore::image(const std::string& id) const {
  const Stopwatch stopwatch(report_, "image");
  return store_.image(id);
}

std::optional<FoundImage> TimedStore::thumbnail(const std::string& id) const {
  const Stopwatch stopwatch(report_, "thumbnail");
  return store_.thumbnail(id);
}

Page TimedStore::list(const Filter& filter, std::size_t limit, const std::optional<std::string>& page_token) const {
  const Stopwatch stopwatch(report_, "list");
  return store_.list(filter, limit, page_token);
}

std::vector<JobRecord> TimedStore::unfinished() const {
  const Stopwatch stopwatch(report_, "unfinished");
  return store_.unfinished();
}

std::string TimedStore::newest_id() const {
  const Stopwatch stopwatch(report_, "newest_id");
  return store_.newest_id();
}

void TimedStore::expire(const Retention& retention, Time now) {
  const Stopwatch stopwatch(report_, "expire");
  store_.expire(retention, now);
}

}  // namespace penumbra::store
