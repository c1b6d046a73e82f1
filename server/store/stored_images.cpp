// The part of the store that has to do with images: their files, and how long they are kept.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "server/store/job_rows.h"
#include "server/store/sha256.h"
#include "server/store/sqlite_store.h"

namespace penumbra::store {

namespace {

constexpr std::size_t expired_at_once = 100;

bool is_disk_full(const std::system_error& error) {
  const int code = error.code().value();
  return code == ENOSPC || code == EDQUOT || code == EFBIG;
}

/// For want of descriptors or memory, not of a disk.
bool is_passing(const std::system_error& error) {
  const int code = error.code().value();
  return code == EMFILE || code == ENFILE || code == ENOMEM;
}

struct Imaged {
  std::string id, image;
};

/// The first rows of jobs that nobody holds.
std::vector<Imaged> rows_of(Query& query, std::size_t most, const Retention& retention) {
  std::vector<Imaged> rows;
  while (rows.size() < most && query.next()) {
    if (!retention.is_held(query.text(0))) rows.push_back({query.text(0), query.text(1)});
  }
  return rows;
}

struct Totals {
  std::int64_t image_bytes = 0, finished_jobs = 0, spec_bytes = 0;
};

Totals totals_of(Database& database) {
  Query totals = database.query("SELECT image_bytes, finished_jobs, spec_bytes FROM totals");
  totals.next();
  return {totals.integer(0), totals.integer(1), totals.integer(2)};
}

bool is_over(std::int64_t value, std::size_t most) { return value > 0 && static_cast<std::uint64_t>(value) > most; }

}  // namespace

/// An image and its preview as they are stored, held until the row that refers to them is committed.
class SqliteStore::Kept {
 public:
  Kept(SqliteStore& store, const Image& image)
      : hash_(image.sha256),
        bytes_(image.bytes->size()),
        media_type_(image.media_type),
        thumbnail_(image.thumbnail),
        hold_(store.blobs_, hash_) {
    if (image.png_preview) {
      preview_ = sha256_hex(*image.png_preview);
      preview_bytes_ = image.png_preview->size();
      preview_hold_.emplace(store.blobs_, *preview_);
      store.write(*preview_, *image.png_preview);
    }
    store.write(hash_, *image.bytes);
  }

  const std::string& hash() const { return hash_; }
  std::size_t bytes() const { return bytes_; }
  void insert(Database& database) const {
    database.query("INSERT OR IGNORE INTO images VALUES (?, ?, ?, ?, ?)")
        .with(hash_, bytes_, media_type_, preview_, preview_bytes_)
        .run();
    if (thumbnail_)
      database.query("INSERT OR IGNORE INTO thumbnails VALUES (?, ?)").with(hash_, Blob{*thumbnail_}).run();
  }

 private:
  std::string hash_;
  std::size_t bytes_, preview_bytes_ = 0;
  std::string media_type_;
  std::shared_ptr<const std::string> thumbnail_;
  std::optional<std::string> preview_;
  Blobs::Hold hold_;
  std::optional<Blobs::Hold> preview_hold_;
};

void SqliteStore::write(const std::string& name, const std::string& bytes) {
  const bool is_stored = (*readers_)([&](Database& database) {
    return database.query("SELECT 1 FROM images WHERE hash = ?1 OR preview = ?1").with(name).next();
  });
  // What a committed row refers to is on the disk.
  if (is_stored && blobs_.is_there(name, bytes.size())) return;
  try {
    blobs_.write(name, bytes);
  } catch (const SyncError& error) {
    writer_->fail(error.what());
  } catch (const std::system_error& error) {
    if (is_disk_full(error)) throw StorageFull();
    if (is_passing(error)) throw;
    writer_->fail(error.what());
  }
  if (writer_->has_failed()) throw StoreFailed("an image could not be stored");
}

bool SqliteStore::finish(const std::string& id, Ending ending) {
  const std::optional<JobRecord> job = find(id);
  if (!job || api::is_final(job->state)) return false;
  const std::optional<std::string> error = packed_if_any(ending.error), stats = packed_if_any(ending.stats);
  std::vector<std::string> names;
  if (ending.image) {
    names.push_back(ending.image->sha256);
    if (ending.image->png_preview) names.push_back(sha256_hex(*ending.image->png_preview));
  }
  bool is_finished = false;
  try {
    std::optional<Kept> kept;
    if (ending.image) kept.emplace(*this, *ending.image);
    writer_->commit([&](Database& database) {
      if (kept) kept->insert(database);
      database
          .query(
              "UPDATE jobs SET state = ?, percent = ?, finished_at = ?, error = ?, stats = ?, image = ?, "
              "size_bytes = ? WHERE id = ? AND state IN (0, 1)")
          .with(number_of(ending.state), ending.percent, number_of(not_before_others(database, ending.finished_at)),
                error, stats, kept ? std::optional(kept->hash()) : std::nullopt,
                kept ? std::optional(kept->bytes()) : std::nullopt, id)
          .run();
      is_finished = database.changes() == 1;
      if (!is_finished && kept) release(database, kept->hash());
    });
  } catch (const StoreFailed&) {
    throw;
  } catch (...) {
    discard(names);
    throw;
  }
  if (!is_finished) discard(names);
  return is_finished;
}

void SqliteStore::discard(const std::vector<std::string>& names) {
  if (names.empty()) return;
  try {
    writer_->commit([&](Database&) { released_.insert(released_.end(), names.begin(), names.end()); });
  } catch (const std::exception&) {
    // The next start finds them.
    return;
  }
}

void SqliteStore::release(Database& database, const std::string& image) {
  Query row =
      database.query("SELECT preview FROM images WHERE hash = ?1 AND NOT EXISTS (SELECT 1 FROM jobs WHERE image = ?1)");
  if (!row.with(image).next()) return;
  released_.push_back(image);
  if (!row.is_null(0)) released_.push_back(row.text(0));
  database.query("DELETE FROM images WHERE hash = ?").with(image).run();
}

void SqliteStore::remove_released(Database& database) {
  for (const std::string& name : released_) {
    const bool is_wanted = database.query("SELECT 1 FROM images WHERE hash = ?1 OR preview = ?1").with(name).next();
    if (!is_wanted) blobs_.remove(name);
  }
  released_.clear();
}

bool SqliteStore::remove(const std::string& id) {
  bool is_removed = false;
  writer_->commit([&](Database& database) { is_removed = forget(database, id); });
  return is_removed;
}

bool SqliteStore::forget(Database& database, const std::string& id) {
  std::string image;
  {
    Query job = database.query("SELECT image FROM jobs WHERE id = ?");
    if (!job.with(id).next()) return false;
    image = job.text(0);
  }
  database.query("DELETE FROM jobs WHERE id = ?").with(id).run();
  if (!image.empty()) release(database, image);
  return true;
}

std::optional<FoundImage> SqliteStore::image(const std::string& id) const {
  FoundImage found;
  std::optional<std::string> preview;
  const bool is_known = (*readers_)([&](Database& database) {
    Query row = database.query(
        "SELECT state, hash, media_type, preview FROM jobs LEFT JOIN images ON images.hash = jobs.image WHERE id = ?");
    if (!row.with(id).next()) return false;
    if (row.integer(0) != number_of(JobState::succeeded)) return true;
    found.state = row.is_null(1) ? ImageState::expired : ImageState::present;
    found.image.sha256 = row.text(1);
    found.image.media_type = row.text(2);
    if (!row.is_null(3)) preview = row.text(3);
    return true;
  });
  if (!is_known) return std::nullopt;
  if (found.state != ImageState::present) return found;
  try {
    found.image.bytes = blobs_.read(found.image.sha256);
    if (preview) found.image.png_preview = blobs_.read(*preview);
  } catch (const std::system_error& error) {
    if (error.code().value() != ENOENT) throw;
    // Expired since its row was read, or removed by somebody else.
    return FoundImage{ImageState::expired, {}};
  }
  return found;
}

std::optional<FoundImage> SqliteStore::thumbnail(const std::string& id) const {
  return (*readers_)([&](Database& database) -> std::optional<FoundImage> {
    Query row = database.query(
        "SELECT state, hash, png FROM jobs LEFT JOIN images ON images.hash = jobs.image "
        "LEFT JOIN thumbnails ON thumbnails.image = images.hash WHERE id = ?");
    if (!row.with(id).next()) return std::nullopt;
    FoundImage found;
    if (row.integer(0) != number_of(JobState::succeeded)) return found;
    found.state = row.is_null(1) ? ImageState::expired : ImageState::present;
    if (row.is_null(2)) return found;
    found.image.bytes = std::make_shared<const std::string>(row.text(2));
    found.image.media_type = "image/png";
    found.image.sha256 = sha256_hex(*found.image.bytes);
    return found;
  });
}

void SqliteStore::expire(const Retention& retention, Time now) {
  bool is_more = true;
  while (is_more) writer_->commit([&](Database& database) { is_more = expire_some(database, retention, now); });
}

bool SqliteStore::expire_some(Database& database, const Retention& retention, Time now) {
  std::vector<Imaged> dropped, stripped, forgotten;
  const auto first = [&](std::size_t most, const char* statement, const auto&... values) {
    Query query = database.query(statement);
    return rows_of(query.with(values...), most, retention);
  };
  const Totals totals = totals_of(database);
  const std::int64_t oldest_image = number_of(now - retention.image_age);
  const std::int64_t oldest_job = number_of(now - retention.job_age);
  dropped =
      first(expired_at_once, "SELECT id, image FROM jobs WHERE image IS NOT NULL AND finished_at < ?", oldest_image);
  if (dropped.empty() && is_over(totals.image_bytes, retention.max_image_bytes))
    dropped = first(1, "SELECT id, image FROM jobs WHERE image IS NOT NULL ORDER BY finished_at, id");
  if (is_over(totals.spec_bytes, retention.max_spec_bytes))
    stripped = first(1, "SELECT id, '' FROM jobs WHERE spec_bytes IS NOT NULL AND state > 1 ORDER BY finished_at, id");
  forgotten = first(expired_at_once, "SELECT id, image FROM jobs WHERE state > 1 AND finished_at < ?", oldest_job);
  if (forgotten.empty() && is_over(totals.finished_jobs, retention.max_jobs)) {
    const std::size_t many = static_cast<std::uint64_t>(totals.finished_jobs) - retention.max_jobs;
    forgotten =
        first(std::min(many, expired_at_once), "SELECT id, image FROM jobs WHERE state > 1 ORDER BY finished_at, id");
  }
  for (const Imaged& job : dropped) {
    database.query("UPDATE jobs SET image = NULL, size_bytes = NULL WHERE id = ?").with(job.id).run();
    release(database, job.image);
  }
  for (const Imaged& job : stripped) {
    database.query("UPDATE jobs SET spec_bytes = NULL WHERE id = ?").with(job.id).run();
    database.query("DELETE FROM specs WHERE job = ?").with(job.id).run();
  }
  for (const Imaged& job : forgotten) forget(database, job.id);
  return !dropped.empty() || !stripped.empty() || !forgotten.empty();
}

}  // namespace penumbra::store
