#include "server/store/sqlite.h"

#include <sqlite3.h>

#include <algorithm>
#include <limits>
#include <new>

#include "server/store/job_store.h"

namespace penumbra::store {

namespace {

constexpr int busy_timeout_ms = 5000;

int note_logged_pages(void* pages, sqlite3*, const char*, int count) {
  *static_cast<int*>(pages) = count;
  return SQLITE_OK;
}

}  // namespace

bool SqlError::is_fatal() const {
  switch (code_ & 0xff) {
    case SQLITE_IOERR:
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PROTOCOL:
      return true;
    default:
      return false;
  }
}

void Database::Close::operator()(sqlite3* connection) const { sqlite3_close_v2(connection); }

void Database::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Database::Database(const std::string& path, Access access) {
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_NOFOLLOW | SQLITE_OPEN_EXRESCODE |
                    (access == Access::write ? SQLITE_OPEN_CREATE : 0);
  sqlite3* connection = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &connection, flags, nullptr);
  connection_.reset(connection);
  if (code != SQLITE_OK) fail(code);
  sqlite3_busy_timeout(connection, busy_timeout_ms);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  run("PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON; PRAGMA foreign_keys=ON; PRAGMA wal_autocheckpoint=0");
  // The data directory may be the only one that can be written to.
  run("PRAGMA temp_store=MEMORY");
  if (access == Access::write) {
    Query mode = query("PRAGMA journal_mode=WAL");
    mode.next();
    if (mode.text(0) != "wal" && mode.text(0) != "memory")
      throw SqlError(SQLITE_CANTOPEN, "the database: this file system has no write-ahead log");
    run("PRAGMA synchronous=FULL");
    sqlite3_wal_hook(connection, note_logged_pages, logged_pages_.get());
  } else {
    run("PRAGMA query_only=ON");
  }
}

void Database::fail(int code) const {
  if (code == SQLITE_FULL) throw StorageFull();
  if (code == SQLITE_NOMEM || code == SQLITE_IOERR_NOMEM || !connection_) throw std::bad_alloc();
  throw SqlError(code, std::string("the database: ") + sqlite3_errmsg(connection_.get()));
}

void Database::run(const char* statements) {
  const int code = sqlite3_exec(connection_.get(), statements, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(code);
}

Query Database::query(const char* statement) {
  Statement& compiled = statements_[statement];
  if (!compiled) {
    sqlite3_stmt* fresh = nullptr;
    const int code = sqlite3_prepare_v3(connection_.get(), statement, -1, SQLITE_PREPARE_PERSISTENT, &fresh, nullptr);
    if (code != SQLITE_OK) fail(code);
    compiled.reset(fresh);
  }
  return {*this, compiled.get()};
}

int Database::changes() const { return sqlite3_changes(connection_.get()); }

bool Database::is_in_transaction() const { return sqlite3_get_autocommit(connection_.get()) == 0; }

void Database::checkpoint(Checkpoint kind) {
  const int mode = kind == Checkpoint::whole ? SQLITE_CHECKPOINT_TRUNCATE : SQLITE_CHECKPOINT_PASSIVE;
  const int code = sqlite3_wal_checkpoint_v2(connection_.get(), nullptr, mode, nullptr, nullptr);
  if (code != SQLITE_OK && code != SQLITE_BUSY) fail(code);
}

Query::~Query() {
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

void Query::check(int code) const {
  if (code != SQLITE_OK) database_.fail(code);
}

bool Query::next() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) database_.fail(code);
  return false;
}

std::int64_t Query::integer(int column) const { return sqlite3_column_int64(statement_, column); }

double Query::real(int column) const { return sqlite3_column_double(statement_, column); }

std::string Query::text(int column) const {
  // As a blob: text would be cut at a zero byte. A value that is there but cannot be had lacks memory.
  const void* bytes = sqlite3_column_blob(statement_, column);
  const int size = sqlite3_column_bytes(statement_, column);
  if (bytes == nullptr) {
    if (sqlite3_errcode(database_.connection_.get()) == SQLITE_NOMEM) throw std::bad_alloc();
    return {};
  }
  return {static_cast<const char*>(bytes), static_cast<std::size_t>(size)};
}

bool Query::is_null(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }

void Query::bind(std::int64_t value) { check(sqlite3_bind_int64(statement_, ++bound_, value)); }

void Query::bind(std::size_t value) {
  constexpr std::size_t most = std::numeric_limits<std::int64_t>::max();
  bind(static_cast<std::int64_t>(std::min(value, most)));
}

void Query::bind(double value) { check(sqlite3_bind_double(statement_, ++bound_, value)); }

void Query::bind(const std::string& text) {
  check(sqlite3_bind_text64(statement_, ++bound_, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8));
}

void Query::bind(Blob blob) {
  check(sqlite3_bind_blob64(statement_, ++bound_, blob.bytes.data(), blob.bytes.size(), SQLITE_STATIC));
}

void Query::bind(std::nullopt_t) { check(sqlite3_bind_null(statement_, ++bound_)); }

}  // namespace penumbra::store
