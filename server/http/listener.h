#pragma once
#include <cstddef>
#include <memory>
#include <string>

#include "server/http/access_log.h"
#include "server/http/connection.h"
#include "server/http/guard.h"
#include "server/http/router.h"
#include "server/metrics/metrics.h"

namespace penumbra::http {

struct ListenerSettings {
  std::string host = "127.0.0.1";
  int port = 8080;  // 0: any free one
  std::size_t max_connections = 1024;
  ConnectionLimits connection;
  /// Of the large bodies of all connections, from the first byte to the answer.
  std::size_t max_held_body_bytes = 1u << 30;
};

/// One address where a router's routes are answered, with threads of its own. `finish` may be called from any thread.
class Listener {
 public:
  /// All of these must outlive the listener.
  Listener(const ListenerSettings& settings, const Router& router, Guard& guard, metrics::Metrics& metrics,
           const AccessLog& log);
  /// Finishes.
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  /// Listens and answers from now on; returns the port. Throws std::system_error when the address cannot be had.
  int open();
  /// Answers what comes over this socket, which it takes over, until the connection ends.
  void serve(int socket);
  /// Lets answers under way finish for a few seconds, then ends every connection.
  void finish();

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace penumbra::http
