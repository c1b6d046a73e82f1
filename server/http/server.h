#pragma once
#include <cstddef>
#include <memory>
#include <string>

#include "server/http/connection.h"
#include "server/jobs/job_manager.h"

namespace penumbra::http {

struct ServerSettings {
  std::string host = "127.0.0.1";
  int port = 8080;  // 0: any free one
  std::size_t max_connections = 1024;
  std::size_t max_event_streams = 512;
  ConnectionLimits connection;
};

/// The HTTP interface of a job manager (section 4 of the contract). `stop` may be called from any thread.
class Server {
 public:
  /// `manager` must outlive the server.
  Server(const ServerSettings& settings, jobs::JobManager& manager);
  /// Stops.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Listens and answers from now on, in threads of its own; returns the port. Throws std::system_error when the
  /// address cannot be had.
  int start();
  /// Lets answers under way finish for a few seconds, then ends every connection.
  void stop();

 private:
  class Listener;
  std::unique_ptr<Listener> listener_;
};

}  // namespace penumbra::http
