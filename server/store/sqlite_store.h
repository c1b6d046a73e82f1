#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/store/blobs.h"
#include "server/store/data_directory.h"
#include "server/store/job_store.h"
#include "server/store/readers.h"
#include "server/store/writer.h"

namespace penumbra::store {

struct SqliteSettings {
  std::string directory;  // made when it is not there
  /// Images are found again only when this is equal.
  std::string engine_version;
  /// Jobs are refused when fewer bytes of the disk are free.
  std::uint64_t disk_reserve_bytes = 256u << 20;
  /// Called once, from any thread, when the store has failed: the server should end.
  std::function<void(const char* reason)> on_failure = [](const char*) {};
};

/// Jobs in a directory: records in a SQLite database, images as files beside it. May be shared between threads.
class SqliteStore : public JobStore {
 public:
  /// Opens or makes the store: jobs that were running are queued again, what interrupted writes left is removed. Throws
  /// std::runtime_error, and has removed nothing, when the directory is in use or does not hold what it should.
  explicit SqliteStore(SqliteSettings settings);
  ~SqliteStore() override;
  SqliteStore(const SqliteStore&) = delete;
  SqliteStore& operator=(const SqliteStore&) = delete;

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
  class Kept;
  struct Reusable {
    std::optional<render::Stats> stats;
    std::string image;
    std::uint64_t bytes;
  };

  Database open();
  /// A job of this hash whose image is there.
  std::optional<Reusable> reusable(Database& database, const std::string& spec_hash) const;
  void write(const std::string& name, const std::string& bytes);
  /// Removes the row of an image that no job has any more, and notes its files in released_.
  void release(Database& database, const std::string& image);
  /// Removes the files in released_ that no row refers to.
  void remove_released(Database& database);
  /// As above, for files that were written in vain.
  void discard(const std::vector<std::string>& names);
  bool forget(Database& database, const std::string& id);
  bool expire_some(Database& database, const Retention& retention, Time now);

  const SqliteSettings settings_;
  DataDirectory directory_;
  mutable Blobs blobs_;                // reading removes what is damaged
  std::vector<std::string> released_;  // only for the writer's thread
  std::unique_ptr<Writer> writer_;
  std::unique_ptr<Readers> readers_;
};

}  // namespace penumbra::store
