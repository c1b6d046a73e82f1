#include "server/store/recovery.h"

#include "api/problems.h"
#include "server/store/job_rows.h"

namespace penumbra::store {

namespace {

constexpr const char* fail_jobs = R"sql(
UPDATE jobs SET state = ?1, crashes = crashes + 1, error = ?2, finished_at = max(?3, created_at, coalesce(started_at, 0))
WHERE state = ?4 AND crashes + 1 >= ?5)sql";

constexpr const char* requeue_jobs =
    "UPDATE jobs SET state = ?1, crashes = crashes + 1, started_at = NULL WHERE state = ?2";

}  // namespace

void check_pages(Database& database) {
  Query check = database.query("PRAGMA quick_check(1)");
  if (!check.next() || check.text(0) != "ok") throw std::runtime_error("the database is damaged: " + check.text(0));
}

void recover(Database& database, const std::string& engine_version, Time now) {
  const std::string error = packed(api::crashed(most_crashes));
  database.run("BEGIN IMMEDIATE");
  database.query(fail_jobs)
      .with(number_of(JobState::failed), error, number_of(now), number_of(JobState::running), most_crashes)
      .run();
  database.query(requeue_jobs).with(number_of(JobState::queued), number_of(JobState::running)).run();
  database.query("UPDATE jobs SET spec_hash = '' WHERE spec_hash <> '' AND (SELECT engine FROM totals) <> ?")
      .with(engine_version)
      .run();
  database.query("UPDATE totals SET engine = ?1 WHERE engine <> ?1").with(engine_version).run();
  database.run("COMMIT");
}

}  // namespace penumbra::store
