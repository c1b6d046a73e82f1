#pragma once
#include <memory>
#include <string>
#include <string_view>

#include "engine/render/stats.h"
#include "server/jobs/job_manager.h"

namespace penumbra::metrics {

/// Everything that is counted, as Prometheus wants it: base units, counters that end in _total. May be shared between
/// threads.
class Metrics {
 public:
  Metrics();
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  /// `route` is one of the router's patterns and `method` one of its methods: both are few.
  void count_request(std::string_view route, std::string_view method, int status);
  /// From the first byte of the request to the last of the answer.
  void request_took(std::string_view route, int status, double seconds);
  void connections_changed(int by);
  void event_streams_changed(int by);

  void job_started(double waited_s);
  void image_rendered(const render::Stats& stats);
  void store_called(std::string_view operation, double seconds);

  /// Prometheus text format 0.0.4.
  std::string text(const jobs::Counts& jobs) const;

 private:
  struct Families;
  std::unique_ptr<Families> families_;
};

}  // namespace penumbra::metrics
