#pragma once
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/store/sqlite.h"

namespace penumbra::store {

/// The one thread that changes a database. Changes that wait at the same time are committed together: each in a
/// savepoint of its own, one fsync for all of them. May be shared between threads.
class Writer {
 public:
  using Change = std::function<void(Database&)>;
  struct Hooks {
    std::function<void(Database&)> after_commit;         // in the writer's thread, before the callers go on
    std::function<void(const char* reason)> on_failure;  // once, when the store has failed
  };

  Writer(Database database, Hooks hooks);
  /// Commits what waits and, unless the store has failed, copies the whole log into the database. Nobody may call
  /// `commit` or read any more. True when all is well on the disk.
  static bool close(std::unique_ptr<Writer> writer);
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Returns once `change` is durable. What it throws is thrown here, and nothing has changed. Throws StoreFailed,
  /// StorageFull, std::bad_alloc.
  void commit(const Change& change);
  /// From now on every `commit` throws StoreFailed.
  void fail(const char* reason) noexcept;
  bool has_failed() const;

 private:
  struct Task {
    const Change* change;
    std::exception_ptr error;
    bool is_done = false;
    Task* next = nullptr;
  };

  void work(const std::stop_token& stop);
  void commit_all(Task* first);
  void apply(Task* first);
  /// What the change threw, as its caller is to see it.
  void note(Task& task, const std::exception_ptr& error) noexcept;

  Database database_;
  const Hooks hooks_;
  const std::exception_ptr failure_;  // a StoreFailed, made while there is memory

  mutable std::mutex mutex_;
  std::condition_variable_any work_available_;
  std::condition_variable done_;
  // Guarded by mutex_:
  Task *first_ = nullptr, *last_ = nullptr;
  bool has_failed_ = false;

  std::jthread thread_;
};

}  // namespace penumbra::store
