#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "server/http/guard.h"
#include "server/http/listener.h"
#include "server/http/routes.h"
#include "server/jobs/job_manager.h"
#include "server/log/log.h"
#include "server/metrics/metrics.h"

namespace penumbra::http {

struct ServerSettings {
  ListenerSettings listener;
  /// A second address for health, readiness and metrics alone, without keys.
  std::optional<ListenerSettings> admin;
  std::optional<KnownHosts> admin_hosts;  // that requests to it may be for; none: any
  StreamLimits streams;
  GuardSettings guard;
  std::optional<log::Format> access_log;  // nothing: no lines
};

/// The HTTP interface of a job manager (section 4 of the contract). `stop` may be called from any thread.
class Server {
 public:
  /// Manager and metrics must outlive the server, as must the keys of the settings.
  Server(const ServerSettings& settings, jobs::JobManager& manager, metrics::Metrics& metrics);
  /// Stops.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  struct Ports {
    int main = 0, admin = 0;  // the second 0 where there is none
  };
  /// Listens and answers from now on, in threads of its own. Throws std::system_error when an address cannot be had.
  Ports start();
  /// Lets answers under way finish for a few seconds, then ends every connection; the second address last.
  void stop();
  /// What the first address answers.
  const std::vector<Route>& routes() const { return router_.routes(); }

 private:
  const AccessLog log_;
  Guard guard_, admin_guard_;
  Router router_, admin_router_;
  std::unique_ptr<Listener> listener_, admin_;
};

}  // namespace penumbra::http
