#include "server/store/writer.h"

#include "server/store/job_store.h"

namespace penumbra::store {

namespace {

constexpr int pages_before_checkpoint = 1000;

}  // namespace

Writer::Writer(Database database, Hooks hooks)
    : database_(std::move(database)),
      hooks_(std::move(hooks)),
      failure_(std::make_exception_ptr(StoreFailed("the store has failed; the log says why"))),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

bool Writer::close(std::unique_ptr<Writer> writer) {
  writer->thread_.request_stop();
  writer->thread_.join();
  if (writer->has_failed()) return false;
  try {
    writer->database_.checkpoint(Database::Checkpoint::whole);
  } catch (const std::exception& error) {
    writer->fail(error.what());
    return false;
  }
  return true;
}

bool Writer::has_failed() const {
  const std::lock_guard lock(mutex_);
  return has_failed_;
}

void Writer::fail(const char* reason) noexcept {
  {
    const std::lock_guard lock(mutex_);
    if (has_failed_) return;
    has_failed_ = true;
  }
  try {
    hooks_.on_failure(reason);
  } catch (...) {
    // No memory to say it: every call does from now on.
    return;
  }
}

void Writer::commit(const Change& change) {
  Task task{&change, nullptr};
  std::unique_lock lock(mutex_);
  if (has_failed_) std::rethrow_exception(failure_);
  (last_ ? last_->next : first_) = &task;
  last_ = &task;
  work_available_.notify_one();
  done_.wait(lock, [&] { return task.is_done; });
  if (task.error) std::rethrow_exception(task.error);
}

void Writer::work(const std::stop_token& stop) {
  while (true) {
    Task* first = nullptr;
    {
      std::unique_lock lock(mutex_);
      work_available_.wait(lock, stop, [&] { return first_ != nullptr; });
      if (first_ == nullptr) return;
      first = first_;
      first_ = last_ = nullptr;
    }
    commit_all(first);
    {
      const std::lock_guard lock(mutex_);
      // A task lives on the stack of its caller, who may go on once it is done.
      for (Task* task = first; task != nullptr;) {
        Task* const next = task->next;
        task->is_done = true;
        task = next;
      }
    }
    done_.notify_all();
  }
}

void Writer::note(Task& task, const std::exception_ptr& error) noexcept {
  task.error = error;
  try {
    std::rethrow_exception(error);
  } catch (const SqlError& sql) {
    if (!sql.is_fatal()) return;
    fail(sql.what());
    task.error = failure_;
  } catch (...) {
    return;
  }
}

void Writer::commit_all(Task* first) {
  if (has_failed()) {
    for (Task* task = first; task != nullptr; task = task->next) task->error = failure_;
    return;
  }
  try {
    database_.query("BEGIN IMMEDIATE").run();
    apply(first);
    database_.query("COMMIT").run();
  } catch (...) {
    for (Task* task = first; task != nullptr; task = task->next) note(*task, std::current_exception());
    try {
      if (database_.is_in_transaction()) database_.query("ROLLBACK").run();
    } catch (const std::exception& error) {
      fail(error.what());
    }
    return;
  }
  try {
    hooks_.after_commit(database_);
    if (database_.logged_pages() >= pages_before_checkpoint) database_.checkpoint(Database::Checkpoint::passive);
  } catch (const SqlError& error) {
    // The changes are durable; that the log cannot be copied ends the store all the same.
    if (error.is_fatal()) fail(error.what());
  } catch (const std::exception&) {
    // Out of memory or a full disk: the next commit tries again.
  }
}

void Writer::apply(Task* first) {
  for (Task* task = first; task != nullptr; task = task->next) {
    database_.query("SAVEPOINT change").run();
    try {
      (*task->change)(database_);
    } catch (...) {
      // An error of the whole transaction has undone the changes of the others too.
      if (!database_.is_in_transaction()) throw;
      database_.query("ROLLBACK TO change").run();
      note(*task, std::current_exception());
    }
    database_.query("RELEASE change").run();
  }
}

}  // namespace penumbra::store
