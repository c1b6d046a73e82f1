#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>

#include "server/jobs/job_manager.h"

namespace penumbra::http {

/// What the HTTP side has done so far. May be shared between threads.
class Metrics {
 public:
  void count_response(int status);
  void connections_changed(int by);
  void event_streams_changed(int by);

  /// Prometheus text format 0.0.4.
  std::string text(const jobs::Counts& jobs) const;

 private:
  mutable std::mutex mutex_;
  // Guarded by mutex_:
  std::map<int, std::uint64_t> responses_;  // by status
  std::int64_t connections_ = 0, event_streams_ = 0;
};

}  // namespace penumbra::http
