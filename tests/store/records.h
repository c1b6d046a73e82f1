#pragma once
#include <doctest/doctest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "server/store/sha256.h"
#include "server/store/sqlite_store.h"
#include "tests/support/temporary_directory.h"

namespace penumbra::test {

using namespace store;
using Outcome = Created::Outcome;
using std::chrono::hours;
using std::chrono::seconds;

inline const Time noon = Time(hours(500'000));

inline SqliteSettings in_directory(const std::string& directory) {
  SqliteSettings settings;
  settings.directory = directory;
  settings.engine_version = "1";
  settings.disk_reserve_bytes = 0;
  return settings;
}

/// The durable store in a directory of its own.
class FreshSqliteStore : TemporaryDirectory, public SqliteStore {
 public:
  FreshSqliteStore() : SqliteStore(in_directory(path())) {}
};

inline JobRecord job_of(const std::string& id, Time created_at = noon) {
  JobRecord job;
  job.id = id;
  job.priority = 7;
  job.progress_interval_s = 0.25;
  job.created_at = created_at;
  job.is_awaited = true;
  job.name = "a ball";
  job.shape = api::ImageShape{640, 480, scene::ImageFormat::exr};
  return job;
}

inline JobRecord job_like(const std::string& id, const std::string& spec_hash, const std::string& owner = "") {
  JobRecord job = job_of(id);
  job.spec_hash = spec_hash;
  job.owner = owner;
  return job;
}

inline Image image_of(const std::string& bytes) {
  return {std::make_shared<const std::string>(bytes), "image/png", sha256_hex(bytes), nullptr, nullptr};
}

inline Ending success(const std::string& bytes, Time finished_at = noon + seconds(2)) {
  Ending ending;
  ending.finished_at = finished_at;
  ending.stats = render::Stats{};
  ending.stats->render_s = 1.5;
  ending.stats->rays = {1, 2, 3, 4};
  ending.stats->skipped["shadows"] = 5;
  ending.stats->estimated_error = 0.1;
  ending.image = image_of(bytes);
  return ending;
}

inline Ending end_in(JobState state) {
  Ending ending;
  ending.state = state;
  ending.percent = 40;
  ending.finished_at = noon + seconds(1);
  if (state == JobState::failed) ending.error = api::Problem{"/problems/x", "X", 500, "it broke", {{"/a", "b"}}};
  return ending;
}

inline std::vector<std::string> ids_of(const std::vector<JobRecord>& jobs) {
  std::vector<std::string> ids;
  for (const JobRecord& job : jobs) ids.push_back(job.id);
  return ids;
}

inline void finish(JobStore& store, const std::string& id, const Ending& ending) {
  store.start(id, noon);
  REQUIRE(store.finish(id, ending));
}

}  // namespace penumbra::test
