#pragma once
#include <functional>
#include <string_view>

#include "server/store/job_store.h"

namespace penumbra::store {

/// Another store, and how long each of its calls takes.
class TimedStore : public JobStore {
 public:
  using Report = std::function<void(std::string_view operation, double seconds)>;

  /// `store` must outlive this; `report` is called in the threads that call the store.
  TimedStore(JobStore& store, Report report) : store_(store), report_(std::move(report)) {}

  Created create(const JobRecord& job, std::string spec, const std::optional<IdempotencyKey>& key) override;
  std::optional<Created> find_key(const IdempotencyKey& key) const override;
  void free_key(const std::string& id) override;
  bool start(const std::string& id, Time started_at) override;
  bool put_back(const std::string& id, double percent) override;
  bool finish(const std::string& id, Ending ending) override;
  bool remove(const std::string& id) override;
  std::optional<JobRecord> find(const std::string& id) const override;
  std::optional<std::string> spec(const std::string& id) const override;
  std::optional<FoundImage> image(const std::string& id) const override;
  std::optional<FoundImage> thumbnail(const std::string& id) const override;
  Page list(const Filter& filter, std::size_t limit, const std::optional<std::string>& page_token) const override;
  std::vector<JobRecord> unfinished() const override;
  std::string newest_id() const override;
  void expire(const Retention& retention, Time now) override;

 private:
  JobStore& store_;
  const Report report_;
};

}  // namespace penumbra::store
