#pragma once
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/store/sqlite.h"

namespace penumbra::store {

/// Connections that only read, each lent to one thread at a time. May be shared between threads.
class Readers {
 public:
  Readers(const std::string& path, int count) {
    free_.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) free_.push_back(std::make_unique<Database>(path, Database::Access::read));
  }

  /// Calls `read` with a connection and returns what it returns.
  template <class Read>
  auto operator()(const Read& read) {
    std::unique_lock lock(mutex_);
    returned_.wait(lock, [&] { return !free_.empty(); });
    Loan loan{*this, std::move(free_.back())};
    free_.pop_back();
    lock.unlock();
    return read(*loan.database);
  }

 private:
  struct Loan {
    Readers& readers;
    std::unique_ptr<Database> database;
    ~Loan() {
      {
        const std::lock_guard lock(readers.mutex_);
        readers.free_.push_back(std::move(database));  // its place is reserved
      }
      readers.returned_.notify_one();
    }
  };

  std::mutex mutex_;
  std::condition_variable returned_;
  std::vector<std::unique_ptr<Database>> free_;  // guarded by mutex_
};

}  // namespace penumbra::store
