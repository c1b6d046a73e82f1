#pragma once
#include <cstddef>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/store/job_store.h"

namespace penumbra::test {

using namespace store;

/// What a store must do, in the plainest way and in memory alone: the others are compared with it. May be shared
/// between threads.
class MemoryStore : public JobStore {
 public:
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
  using KeyName = std::pair<std::string, std::string>;  // owner, key
  struct Entry {
    JobRecord job;
    std::optional<std::string> spec;
    KeyName key;
    FoundImage found;
  };
  struct KeyUse {
    std::string body_sha256, id;
  };
  struct KeptImage {
    std::size_t bytes = 0, jobs = 0;
  };
  using Entries = std::map<std::string, Entry>;  // by id: oldest first

  /// Each of these needs mutex_ held.
  std::optional<Created> use_of(const IdempotencyKey& key) const;
  Time not_before_others(Time end) const;
  void keep_image(Entry& entry, Image image);
  void drop_image(Entry& entry);
  void drop_spec(Entry& entry);
  void erase(Entries::iterator entry);

  mutable std::mutex mutex_;
  // Guarded by mutex_:
  Entries entries_;
  std::map<KeyName, KeyUse> keys_;
  std::map<std::string, KeptImage> images_;  // by hash
  std::size_t image_bytes_ = 0, spec_bytes_ = 0;
  std::size_t finished_jobs_ = 0;
};

}  // namespace penumbra::test
