#include "server/store/schema.h"

#include <stdexcept>
#include <string>

namespace penumbra::store {

namespace {

constexpr int application_id = 0x50656e75, version = 1;

constexpr const char* read_application = "PRAGMA application_id";
constexpr const char* read_version = "PRAGMA user_version";
constexpr const char* read_schema = "SELECT type, name, tbl_name, coalesce(sql, '') FROM sqlite_schema ORDER BY name";

// Times are nanoseconds since 1970. An image is a file in blobs/ named by its SHA-256, as is its preview.
constexpr const char* tables = R"sql(
CREATE TABLE images (
  hash TEXT PRIMARY KEY,
  bytes INTEGER NOT NULL,
  media_type TEXT NOT NULL,
  preview TEXT,
  preview_bytes INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
CREATE INDEX images_preview ON images (preview) WHERE preview IS NOT NULL;

CREATE TABLE jobs (
  id TEXT PRIMARY KEY,
  owner TEXT NOT NULL,
  state INTEGER NOT NULL CHECK (state BETWEEN 0 AND 4),
  priority INTEGER NOT NULL,
  progress_interval_s REAL NOT NULL,
  percent REAL NOT NULL,
  crashes INTEGER NOT NULL,
  created_at INTEGER NOT NULL,
  started_at INTEGER,
  finished_at INTEGER,
  error TEXT,
  stats TEXT,
  spec_hash TEXT NOT NULL,
  image TEXT REFERENCES images
) STRICT, WITHOUT ROWID;
CREATE INDEX jobs_owner ON jobs (owner, id);
CREATE INDEX jobs_state ON jobs (state, id);
CREATE INDEX jobs_owner_state ON jobs (owner, state, id);
CREATE INDEX jobs_finished ON jobs (finished_at) WHERE state > 1;
CREATE INDEX jobs_imaged ON jobs (id) WHERE image IS NOT NULL;
CREATE INDEX jobs_imaged_finished ON jobs (finished_at) WHERE image IS NOT NULL;
CREATE INDEX jobs_image ON jobs (image) WHERE image IS NOT NULL;
CREATE INDEX jobs_spec_hash ON jobs (spec_hash) WHERE image IS NOT NULL AND spec_hash <> '';

CREATE TABLE specs (
  job TEXT PRIMARY KEY REFERENCES jobs ON DELETE CASCADE,
  body TEXT NOT NULL
) STRICT;

CREATE TABLE keys (
  owner TEXT NOT NULL,
  key TEXT NOT NULL,
  body_hash TEXT NOT NULL,
  job TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  PRIMARY KEY (owner, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX keys_job ON keys (job);

CREATE TABLE totals (image_bytes INTEGER NOT NULL, finished_jobs INTEGER NOT NULL, engine TEXT NOT NULL) STRICT;
INSERT INTO totals VALUES (0, 0, '');
CREATE TRIGGER image_added AFTER INSERT ON images BEGIN
  UPDATE totals SET image_bytes = image_bytes + NEW.bytes + NEW.preview_bytes;
END;
CREATE TRIGGER image_dropped AFTER DELETE ON images BEGIN
  UPDATE totals SET image_bytes = image_bytes - OLD.bytes - OLD.preview_bytes;
END;
CREATE TRIGGER job_added AFTER INSERT ON jobs WHEN NEW.state > 1 BEGIN
  UPDATE totals SET finished_jobs = finished_jobs + 1;
END;
CREATE TRIGGER job_finished AFTER UPDATE OF state ON jobs WHEN OLD.state < 2 AND NEW.state > 1 BEGIN
  UPDATE totals SET finished_jobs = finished_jobs + 1;
END;
CREATE TRIGGER job_dropped AFTER DELETE ON jobs WHEN OLD.state > 1 BEGIN
  UPDATE totals SET finished_jobs = finished_jobs - 1;
END;
)sql";

std::int64_t number(Database& database, const char* pragma) {
  Query query = database.query(pragma);
  query.next();
  return query.integer(0);
}

std::string schema_of(Database& database) {
  std::string text;
  Query query = database.query(read_schema);
  while (query.next()) {
    for (int column = 0; column < 4; ++column) text += query.text(column) + "\n";
  }
  return text;
}

std::string expected_schema() {
  Database database(":memory:", Database::Access::write);
  database.run(tables);
  return schema_of(database);
}

void create(Database& database) {
  const std::string numbers =
      "PRAGMA application_id=" + std::to_string(application_id) + "; PRAGMA user_version=" + std::to_string(version);
  database.run("BEGIN IMMEDIATE");
  database.run(tables);
  database.run(numbers.c_str());
  database.run("COMMIT");
}

}  // namespace

void prepare_schema(Database& database) {
  const std::int64_t application = number(database, read_application), found = number(database, read_version);
  const std::string schema = schema_of(database);
  if (application == 0 && found == 0 && schema.empty()) {
    create(database);
  } else if (application != application_id) {
    throw std::runtime_error("the database is not one of Penumbra");
  } else if (found > version) {
    throw std::runtime_error("the database has version " + std::to_string(found) +
                             ", made by a newer Penumbra; this one knows versions up to " + std::to_string(version));
  } else if (found != version || schema != expected_schema()) {
    throw std::runtime_error("the tables of the database are not those that Penumbra makes");
  }
}

}  // namespace penumbra::store
