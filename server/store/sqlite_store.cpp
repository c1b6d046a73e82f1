#include "server/store/sqlite_store.h"

#include <spdlog/spdlog.h>

#include <cerrno>
#include <filesystem>

#include "server/store/job_rows.h"
#include "server/store/recovery.h"
#include "server/store/schema.h"

namespace penumbra::store {

namespace {

constexpr int reader_count = 4;

std::optional<JobRecord> job_with(Database& database, const std::string& id) {
  Query job = database.query("SELECT * FROM jobs WHERE id = ?");
  if (!job.with(id).next()) return std::nullopt;
  return job_of(job);
}

std::optional<Created> use_of(Database& database, const IdempotencyKey& key) {
  Query use = database.query("SELECT job, body_hash FROM keys WHERE owner = ? AND key = ?");
  if (!use.with(key.owner, key.key).next()) return std::nullopt;
  std::optional<JobRecord> job = job_with(database, use.text(0));
  if (!job || job->state == JobState::canceled) return std::nullopt;
  const bool is_same = use.text(1) == key.body_sha256;
  return Created{is_same ? Created::Outcome::repeated : Created::Outcome::conflict, std::move(*job)};
}

bool is_image_known(Database& database, const std::string& hash) {
  return database.query("SELECT 1 FROM images WHERE hash = ?1 OR preview = ?1").with(hash).next();
}

}  // namespace

SqliteStore::SqliteStore(SqliteSettings settings)
    : settings_(std::move(settings)), directory_(settings_.directory), blobs_(directory_.blobs()) {
  Writer::Hooks hooks;
  hooks.after_commit = [this](Database& database) { remove_released(database); };
  hooks.on_failure = settings_.on_failure;
  Database database = open();
  readers_ = std::make_unique<Readers>(directory_.database(), reader_count);
  writer_ = std::make_unique<Writer>(std::move(database), std::move(hooks));
}

Database SqliteStore::open() {
  const bool is_unclean = directory_.is_unclean();
  try {
    // One that was killed while it began leaves an empty file, and a single byte is none to SQLite.
    const bool has_database =
        std::filesystem::exists(directory_.database()) && std::filesystem::file_size(directory_.database()) > 1;
    if (!has_database && !blobs_.is_empty()) throw std::runtime_error("there are images, but the database is missing");
    directory_.mark_unclean();
    Database database(directory_.database(), Database::Access::write);
    prepare_schema(database);
    if (is_unclean) check_pages(database);
    recover(database, settings_.engine_version, std::chrono::system_clock::now());
    sync_directory(directory_.path());
    blobs_.collect([&](const std::string& name) { return is_image_known(database, name); });
    return database;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw std::runtime_error("the store " + directory_.path() + " cannot be used: " + error.what());
  }
}

SqliteStore::~SqliteStore() {
  const bool is_well = Writer::close(std::move(writer_));
  if (!is_well) return;
  try {
    directory_.mark_clean();
  } catch (const std::exception& error) {
    spdlog::error("the store is left as after a crash: {}", error.what());
  }
}

Created SqliteStore::create(const JobRecord& job, std::string spec, const std::optional<IdempotencyKey>& key) {
  try {
    if (free_bytes(directory_.path()) < settings_.disk_reserve_bytes) throw StorageFull();
  } catch (const std::system_error& error) {
    writer_->fail(error.what());
    throw StoreFailed("the directory of the store is gone");
  }
  Created created;
  writer_->commit([&](Database& database) {
    if (key) {
      if (std::optional<Created> use = use_of(database, *key)) {
        created = std::move(*use);
        return;
      }
    }
    created = {Created::Outcome::created, job};
    std::optional<std::string> image;
    if (std::optional<Reusable> equal = reusable(database, job.spec_hash)) {
      created.job.state = JobState::succeeded;
      created.job.percent = 100;
      created.job.started_at = job.created_at;
      created.job.finished_at = not_before_others(database, job.created_at);
      created.job.stats = std::move(equal->stats);
      created.job.size_bytes = equal->bytes;
      image = std::move(equal->image);
    }
    insert(database, created.job, image, spec.size());
    database.query("INSERT INTO specs VALUES (?, ?)").with(job.id, spec).run();
    if (key) {
      database.query("INSERT OR REPLACE INTO keys VALUES (?, ?, ?, ?)")
          .with(key->owner, key->key, key->body_sha256, job.id)
          .run();
    }
  });
  return created;
}

std::optional<SqliteStore::Reusable> SqliteStore::reusable(Database& database, const std::string& spec_hash) const {
  if (spec_hash.empty()) return std::nullopt;
  Query equal = database.query(
      "SELECT jobs.*, images.bytes FROM jobs JOIN images ON images.hash = jobs.image "
      "WHERE spec_hash = ? AND image IS NOT NULL AND spec_hash <> '' LIMIT 1");
  if (!equal.with(spec_hash).next()) return std::nullopt;
  const std::string image = equal.text(static_cast<int>(Column::image));
  const auto bytes = static_cast<std::uint64_t>(equal.integer(static_cast<int>(Column::after_last)));
  // Somebody may have removed the file.
  if (!blobs_.is_there(image, bytes)) return std::nullopt;
  return Reusable{job_of(equal).stats, image, bytes};
}

std::optional<Created> SqliteStore::find_key(const IdempotencyKey& key) const {
  return (*readers_)([&](Database& database) { return use_of(database, key); });
}

void SqliteStore::free_key(const std::string& id) {
  writer_->commit([&](Database& database) { database.query("DELETE FROM keys WHERE job = ?").with(id).run(); });
}

bool SqliteStore::start(const std::string& id, Time started_at) {
  bool is_started = false;
  writer_->commit([&](Database& database) {
    database.query("UPDATE jobs SET state = ?, started_at = ? WHERE id = ? AND state = ?")
        .with(number_of(JobState::running), number_of(started_at), id, number_of(JobState::queued))
        .run();
    is_started = database.changes() == 1;
  });
  return is_started;
}

bool SqliteStore::put_back(const std::string& id, double percent) {
  bool is_back = false;
  writer_->commit([&](Database& database) {
    database.query("UPDATE jobs SET state = ?, started_at = NULL, percent = ? WHERE id = ? AND state = ?")
        .with(number_of(JobState::queued), percent, id, number_of(JobState::running))
        .run();
    is_back = database.changes() == 1;
  });
  return is_back;
}

std::optional<JobRecord> SqliteStore::find(const std::string& id) const {
  return (*readers_)([&](Database& database) { return job_with(database, id); });
}

std::optional<std::string> SqliteStore::spec(const std::string& id) const {
  return (*readers_)([&](Database& database) -> std::optional<std::string> {
    Query spec = database.query("SELECT body FROM specs WHERE job = ?");
    if (!spec.with(id).next()) return std::nullopt;
    return spec.text(0);
  });
}

Page SqliteStore::list(const Filter& filter, std::size_t limit, const std::optional<std::string>& page_token) const {
  const char* const statement =
      filter.owner && filter.state
          ? "SELECT * FROM jobs WHERE id < ?1 AND owner = ?3 AND state = ?4 ORDER BY id DESC LIMIT ?2"
      : filter.owner ? "SELECT * FROM jobs WHERE id < ?1 AND owner = ?3 ORDER BY id DESC LIMIT ?2"
      : filter.state ? "SELECT * FROM jobs WHERE id < ?1 AND state = ?3 ORDER BY id DESC LIMIT ?2"
                     : "SELECT * FROM jobs WHERE id < ?1 ORDER BY id DESC LIMIT ?2";
  const std::string before = page_token.value_or("\x7f");  // greater than every id
  return (*readers_)([&](Database& database) {
    Query jobs = database.query(statement);
    jobs.with(before, limit + 1);
    if (filter.owner) jobs.with(*filter.owner);
    if (filter.state) jobs.with(number_of(*filter.state));
    Page page;
    while (jobs.next()) {
      if (page.jobs.size() == limit) {
        page.next_page_token = page.jobs.back().id;
        break;
      }
      page.jobs.push_back(job_of(jobs));
    }
    return page;
  });
}

std::vector<JobRecord> SqliteStore::unfinished() const {
  return (*readers_)([&](Database& database) {
    std::vector<JobRecord> found;
    Query jobs = database.query("SELECT * FROM jobs WHERE state IN (0, 1) ORDER BY id");
    while (jobs.next()) found.push_back(job_of(jobs));
    return found;
  });
}

std::string SqliteStore::newest_id() const {
  return (*readers_)([&](Database& database) {
    Query newest = database.query("SELECT coalesce(max(id), '') FROM jobs");
    newest.next();
    return newest.text(0);
  });
}

}  // namespace penumbra::store
