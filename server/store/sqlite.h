#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace penumbra::store {

/// What SQLite says is wrong. Lack of memory is std::bad_alloc and a full disk StorageFull instead.
class SqlError : public std::runtime_error {
 public:
  SqlError(int code, const std::string& message) : std::runtime_error(message), code_(code) {}
  /// Whether the disk or what is on it is to blame, so that nothing more should be written.
  bool is_fatal() const;

 private:
  int code_;
};

/// Bytes that are no text, to be bound.
struct Blob {
  const std::string& bytes;
};

class Query;

/// A connection to a SQLite database; for one thread at a time.
class Database {
 public:
  enum class Access { write, read };
  /// Creates the file for `write`. Throws SqlError.
  Database(const std::string& path, Access access);
  Database(Database&&) noexcept = default;
  Database& operator=(Database&&) noexcept = default;

  /// Runs statements that have no parameters and whose rows nobody needs.
  void run(const char* statements);
  /// A statement ready to be bound. It is compiled once: `statement` must be a string that lives for ever.
  Query query(const char* statement);

  /// Rows changed by the last INSERT, UPDATE or DELETE.
  int changes() const;
  bool is_in_transaction() const;
  /// passive: as far as readers allow · whole: all of it, and the log is empty afterwards.
  enum class Checkpoint { passive, whole };
  /// Copies the write-ahead log into the database. The connection does so at no other time.
  void checkpoint(Checkpoint kind);
  /// The size of the write-ahead log, in pages, after the last commit of this connection.
  int logged_pages() const { return *logged_pages_; }

 private:
  friend class Query;
  struct Close {
    void operator()(sqlite3* connection) const;
  };
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

  [[noreturn]] void fail(int code) const;

  std::unique_ptr<int> logged_pages_ = std::make_unique<int>(0);
  std::unique_ptr<sqlite3, Close> connection_;
  std::map<const char*, Statement> statements_;
};

/// One use of a statement, reset at the end. Parameters are bound in order, then `next` goes from row to row; columns
/// count from 0. Text and bytes that are bound must live as long as the query.
class Query {
 public:
  Query(Database& database, sqlite3_stmt* statement) : database_(database), statement_(statement) {}
  ~Query();
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;

  template <class... Values>
  Query& with(const Values&... values) {
    (bind(values), ...);
    return *this;
  }
  /// Steps to the next row; false after the last one.
  bool next();
  /// For statements without rows.
  void run() {
    while (next()) continue;
  }

  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;
  bool is_null(int column) const;

 private:
  void bind(std::int64_t value);
  void bind(int value) { bind(std::int64_t{value}); }
  void bind(std::size_t value);
  void bind(double value);
  void bind(const std::string& text);
  void bind(Blob blob);
  void bind(std::nullopt_t);
  template <class Value>
  void bind(const std::optional<Value>& value) {
    if (value) {
      bind(*value);
    } else {
      bind(std::nullopt);
    }
  }
  void check(int code) const;

  Database& database_;
  sqlite3_stmt* statement_;
  int bound_ = 0;
};

}  // namespace penumbra::store
