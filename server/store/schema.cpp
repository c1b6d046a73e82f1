#include "server/store/schema.h"

#include <array>
#include <stdexcept>
#include <string>

namespace penumbra::store {

namespace {

constexpr int application_id = 0x50656e75;

constexpr const char* read_application = "PRAGMA application_id";
constexpr const char* read_version = "PRAGMA user_version";
constexpr const char* read_schema = "SELECT type, name, tbl_name, coalesce(sql, '') FROM sqlite_schema ORDER BY name";

// Times are nanoseconds since 1970. An image is a file in blobs/ named by its SHA-256, as is its preview.
constexpr const char* version_1 = R"sql(
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

// What version 1.0 of Penumbra has not noted: of finished jobs it has thrown the bodies away. Those of the others were
// checked when they came.
constexpr const char* version_2 = R"sql(
ALTER TABLE jobs ADD COLUMN name TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN width INTEGER;
ALTER TABLE jobs ADD COLUMN height INTEGER;
ALTER TABLE jobs ADD COLUMN format INTEGER CHECK (format BETWEEN 0 AND 1);
ALTER TABLE jobs ADD COLUMN size_bytes INTEGER;
ALTER TABLE jobs ADD COLUMN spec_bytes INTEGER;
ALTER TABLE jobs ADD COLUMN is_awaited INTEGER NOT NULL DEFAULT 0;
UPDATE jobs SET size_bytes = (SELECT bytes FROM images WHERE hash = image) WHERE image IS NOT NULL;
UPDATE jobs SET (name, width, height, format, spec_bytes) = (
  SELECT coalesce(json_extract(body, '$.scene.name'), ''),
         CAST(coalesce(json_extract(body, '$.options.width'), 800) AS INTEGER),
         CAST(coalesce(json_extract(body, '$.options.height'), 800) AS INTEGER),
         coalesce(json_extract(body, '$.options.format'), 'png') = 'exr',
         length(CAST(body AS BLOB))
  FROM specs WHERE job = id)
WHERE id IN (SELECT job FROM specs WHERE json_valid(body));
CREATE INDEX jobs_spec_finished ON jobs (finished_at) WHERE spec_bytes IS NOT NULL AND state > 1;

CREATE TABLE thumbnails (
  image TEXT PRIMARY KEY REFERENCES images ON DELETE CASCADE,
  png BLOB NOT NULL
) STRICT;
CREATE TRIGGER thumbnail_added AFTER INSERT ON thumbnails BEGIN
  UPDATE totals SET image_bytes = image_bytes + length(NEW.png);
END;
CREATE TRIGGER thumbnail_dropped AFTER DELETE ON thumbnails BEGIN
  UPDATE totals SET image_bytes = image_bytes - length(OLD.png);
END;

ALTER TABLE totals ADD COLUMN spec_bytes INTEGER NOT NULL DEFAULT 0;
UPDATE totals SET spec_bytes = (SELECT coalesce(sum(spec_bytes), 0) FROM jobs);
CREATE TRIGGER spec_added AFTER INSERT ON jobs WHEN NEW.spec_bytes IS NOT NULL BEGIN
  UPDATE totals SET spec_bytes = spec_bytes + NEW.spec_bytes;
END;
CREATE TRIGGER spec_dropped AFTER UPDATE OF spec_bytes ON jobs BEGIN
  UPDATE totals SET spec_bytes = spec_bytes + coalesce(NEW.spec_bytes, 0) - coalesce(OLD.spec_bytes, 0);
END;
CREATE TRIGGER spec_removed AFTER DELETE ON jobs WHEN OLD.spec_bytes IS NOT NULL BEGIN
  UPDATE totals SET spec_bytes = spec_bytes - OLD.spec_bytes;
END;
)sql";

// What makes each version of the tables from the one before; a new database goes through all of them.
constexpr std::array steps{version_1, version_2};
constexpr std::size_t newest_version = steps.size();

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

std::string expected_schema(std::size_t version) {
  Database database(":memory:", Database::Access::write);
  for (std::size_t i = 0; i < version; ++i) database.run(steps[i]);
  return schema_of(database);
}

/// From `version` to the newest one: all of the way or none of it.
void upgrade(Database& database, std::size_t version) {
  const std::string numbers = "PRAGMA application_id=" + std::to_string(application_id) +
                              "; PRAGMA user_version=" + std::to_string(newest_version);
  database.run("BEGIN IMMEDIATE");
  for (std::size_t i = version; i < newest_version; ++i) database.run(steps[i]);
  database.run(numbers.c_str());
  database.run("COMMIT");
}

}  // namespace

void prepare_schema(Database& database) {
  const std::int64_t application = number(database, read_application), found = number(database, read_version);
  const std::string schema = schema_of(database);
  if (application == 0 && found == 0 && schema.empty()) return upgrade(database, 0);
  if (application != application_id) throw std::runtime_error("the database is not one of Penumbra");
  if (found > static_cast<std::int64_t>(newest_version)) {
    throw std::runtime_error("the database has version " + std::to_string(found) +
                             ", made by a newer Penumbra; this one knows versions up to " +
                             std::to_string(newest_version));
  }
  const auto version = static_cast<std::size_t>(found);
  if (found < 1 || schema != expected_schema(version))
    throw std::runtime_error("the tables of the database are not those that Penumbra makes");
  if (version < newest_version) upgrade(database, version);
}

}  // namespace penumbra::store
