#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <future>
#include <iostream>
#include <memory>
#include <mutex>

#include "engine/render/render.h"
#include "engine/system/cores.h"
#include "server/access/key_ring.h"
#include "server/cli/command.h"
#include "server/cli/flags.h"
#include "server/cli/input.h"
#include "server/cli/serve_settings.h"
#include "server/cli/stop_signals.h"
#include "server/http/server.h"
#include "server/jobs/job_manager.h"
#include "server/jobs/spec_hash.h"
#include "server/log/log.h"
#include "server/metrics/metrics.h"
#include "server/store/sqlite_store.h"
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

/// Why the server ends: the first reason counts. May be shared between threads.
class End {
 public:
  void ask(int status) {
    std::call_once(once_, [&] { status_.set_value(status); });
  }
  int wait() { return status_.get_future().get(); }

 private:
  std::once_flag once_;
  std::promise<int> status_;
};

int serve(ServeSettings settings) {
  if (const auto complaint = complaint_about(settings)) {
    std::cerr << "penumbra serve: " << *complaint << "\n";
    return status_unusable;
  }
  complete(settings);
  const log::Output output(*settings.http.access_log, settings.log_level);

  // A limit on the size of files is a full disk, and no reason to die.
  std::signal(SIGXFSZ, SIG_IGN);
  End end;
  std::atomic<access::KeyRing*> reloaded = nullptr;
  const StopSignals signals([&] { end.ask(status_done); },
                            settings.keys.empty() ? std::function<void()>() : [&] {
                              if (access::KeyRing* ring = reloaded) ring->reload();
                            });
  const std::unique_ptr<access::KeyRing> keys = key_ring(settings.keys);
  reloaded = keys.get();
  settings.http.guard.keys = keys.get();

  metrics::Metrics metrics;
  settings.jobs.on_start = [&](double waited_s) { metrics.job_started(waited_s); };
  settings.jobs.on_image = [&](const render::Stats& stats) { metrics.image_rendered(stats); };
  store::SqliteStore store(
      {settings.store, jobs::engine_version(), settings.disk_reserve_bytes, [&](const char* reason) {
         spdlog::critical("the store has failed, the server ends: {}", reason);
         end.ask(status_failed);
       }});
  store::TimedStore timed_store(store, [&](auto operation, double took_s) { metrics.store_called(operation, took_s); });
  system::Pool pool(render::thread_limit(settings.threads, system::available_cores()), !settings.is_priority_normal);
  jobs::JobManager manager(settings.jobs, timed_store, pool);
  http::Server server(settings.http, manager, metrics);
  const http::Server::Ports ports = server.start();
  std::cout << "listening on " << address_of(settings.http.listener, ports.main) << "\n";
  if (settings.http.admin) std::cout << "administration on " << address_of(*settings.http.admin, ports.admin) << "\n";
  std::cout.flush();
  spdlog::info("{} render threads, {} jobs at once, {} may wait; jobs are kept in {}", pool.size(), settings.jobs.jobs,
               settings.jobs.max_queued, settings.store);

  const int status = end.wait();
  spdlog::info("stopping");
  manager.stop();
  server.stop();
  reloaded = nullptr;
  spdlog::info("stopped");
  return status;
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
