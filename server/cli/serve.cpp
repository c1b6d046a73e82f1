#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <future>
#include <iostream>
#include <memory>

#include "engine/render/render.h"
#include "server/access/key_ring.h"
#include "server/cli/command.h"
#include "server/cli/flags.h"
#include "server/cli/input.h"
#include "server/cli/serve_settings.h"
#include "server/cli/stop_signals.h"
#include "server/http/server.h"
#include "server/jobs/job_manager.h"
#include "server/log/log.h"
#include "server/metrics/metrics.h"
#include "server/store/memory_store.h"
#include "server/store/timed_store.h"

namespace penumbra::cli {

namespace {

std::string address_of(const http::ListenerSettings& listener, int port) { return url_of({listener.host, port}); }

std::unique_ptr<access::KeyRing> key_ring(const std::string& file) {
  if (file.empty()) return nullptr;
  try {
    return std::make_unique<access::KeyRing>(file);
  } catch (const std::exception& error) {
    throw UnusableArgument("--keys " + file + ": " + error.what());
  }
}

int serve(ServeSettings settings) {
  if (const auto complaint = complaint_about(settings)) {
    std::cerr << "penumbra serve: " << *complaint << "\n";
    return status_unusable;
  }
  complete(settings);
  log::configure(*settings.http.access_log, settings.log_level);
  if (!settings.store.empty())
    spdlog::warn("--store {}: jobs are kept in memory in this version and are gone when the server ends",
                 settings.store);

  std::promise<void> stop_asked;
  std::atomic<access::KeyRing*> reloaded = nullptr;
  const StopSignals signals([&] { stop_asked.set_value(); },
                            [&] {
                              if (access::KeyRing* ring = reloaded) ring->reload();
                            });
  const std::unique_ptr<access::KeyRing> keys = key_ring(settings.keys);
  reloaded = keys.get();
  settings.http.guard.keys = keys.get();

  metrics::Metrics metrics;
  settings.jobs.on_start = [&](double waited_s) { metrics.job_started(waited_s); };
  settings.jobs.on_end = [&](const store::Ending& ending) { metrics.job_ended(ending); };
  store::MemoryStore store;
  store::TimedStore timed_store(store, [&](auto operation, double took_s) { metrics.store_called(operation, took_s); });
  render::Pool pool(render::thread_limit(settings.threads, render::available_cores()), !settings.is_priority_normal);
  jobs::JobManager manager(settings.jobs, timed_store, pool);
  http::Server server(settings.http, manager, metrics);
  const http::Server::Ports ports = server.start();
  std::cout << "listening on " << address_of(settings.http.listener, ports.main) << "\n";
  if (settings.http.admin) std::cout << "administration on " << address_of(*settings.http.admin, ports.admin) << "\n";
  std::cout.flush();
  spdlog::info("{} render threads, {} jobs at once, {} may wait", pool.size(), settings.jobs.jobs,
               settings.jobs.max_queued);

  stop_asked.get_future().wait();
  spdlog::info("stopping");
  manager.stop();
  server.stop();
  reloaded = nullptr;
  spdlog::info("stopped");
  return status_done;
}

}  // namespace

Command add_serve(CLI::App& program) {
  const auto settings = std::make_shared<ServeSettings>();
  CLI::App* command = program.add_subcommand("serve", "Answer HTTP: queue jobs, render them, stream their progress");
  add_serve_flags(*command, *settings);
  add_environment_twins(*command);
  return {command, [settings] { return serve(*settings); }};
}

}  // namespace penumbra::cli
