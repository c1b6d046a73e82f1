#pragma once
#include <cstddef>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/store/job_store.h"

namespace penumbra::store {

/// Jobs in memory: gone when the process ends. May be shared between threads.
class MemoryStore : public JobStore {
 public:
  Created create(const JobRecord& job, std::string spec, const std::optional<IdempotencyKey>& key) override;
  std::optional<Created> find_key(const IdempotencyKey& key) const override;
  bool start(const std::string& id, Time started_at) override;
  bool finish(const std::string& id, Ending ending) override;
  bool remove(const std::string& id) override;
  std::optional<JobRecord> find(const std::string& id) const override;
  std::optional<std::string> spec(const std::string& id) const override;
  std::optional<FoundImage> image(const std::string& id) const override;
  Page list(const Filter& filter, std::size_t limit, const std::optional<std::string>& page_token) const override;
  std::vector<JobRecord> unfinished() const override;
  void expire(const Retention& retention, Time now) override;

 private:
  struct Entry {
    JobRecord job;
    std::string spec;
    std::string key;
    FoundImage found;
  };
  struct KeyUse {
    std::string body_sha256, id;
  };
  using Entries = std::map<std::string, Entry>;  // by id: oldest first

  /// Each of these needs mutex_ held.
  std::optional<Created> use_of(const IdempotencyKey& key) const;
  void drop_image(Entry& entry);
  Entries::iterator erase(Entries::iterator entry);

  mutable std::mutex mutex_;
  // Guarded by mutex_:
  Entries entries_;
  std::map<std::string, KeyUse> keys_;  // by owner and key
  std::size_t image_bytes_ = 0;
  std::size_t finished_jobs_ = 0;
};

}  // namespace penumbra::store
