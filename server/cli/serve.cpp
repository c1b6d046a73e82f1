#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <future>
#include <iostream>
#include <memory>

#include "engine/render/render.h"
#include "server/cli/address.h"
#include "server/cli/command.h"
#include "server/cli/flags.h"
#include "server/cli/stop_signals.h"
#include "server/http/server.h"
#include "server/jobs/job_manager.h"
#include "server/store/memory_store.h"

namespace penumbra::cli {

namespace {

constexpr std::size_t spare_connections = 256;  // beside event streams and calls that wait for their image

struct Settings {
  std::string listen = "127.0.0.1:8080", store, log_level = "info";
  bool is_public_allowed = false, is_priority_normal = false;
  int threads = scene::all_threads;
  double request_timeout_s = 30, job_time_limit_s = 0;
  jobs::Settings jobs;
  http::ServerSettings http;
};

void configure_log(const std::string& level) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("penumbra"));
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %^%l%$ %v", spdlog::pattern_time_type::utc);
}

/// One for every connection that may be open, as far as the system lets us.
void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

/// A complaint about the arguments, if there is one.
std::optional<std::string> complaint_about(const Settings& settings) {
  const std::optional<Address> address = parse_address(settings.listen);
  if (!address) return "--listen: " + settings.listen + " is not HOST:PORT";
  if (!is_loopback(address->host) && !settings.is_public_allowed)
    return "--listen: others can reach " + address->host +
           ", and no keys are asked for; --allow-public if that is meant";
  if (settings.store.starts_with("postgresql://") || settings.store.starts_with("postgres://"))
    return "--store: the PostgreSQL store is not part of this version";
  return std::nullopt;
}

int serve(Settings settings) {
  if (const auto complaint = complaint_about(settings)) {
    std::cerr << "penumbra serve: " << *complaint << "\n";
    return status_unusable;
  }
  configure_log(settings.log_level);
  raise_descriptor_limit();
  if (!settings.store.empty())
    spdlog::warn("--store {}: jobs are kept in memory in this version and are gone when the server ends",
                 settings.store);

  Address address = *parse_address(settings.listen);
  if (settings.job_time_limit_s > 0) settings.jobs.time_limit_s = settings.job_time_limit_s;
  settings.http.host = address.host;
  settings.http.port = address.port;
  settings.http.max_connections = settings.http.max_event_streams + settings.jobs.max_queued +
                                  static_cast<std::size_t>(settings.jobs.jobs) + spare_connections;
  settings.http.connection.max_body_bytes = settings.jobs.limits.max_body_bytes;
  settings.http.connection.request =
      std::chrono::milliseconds(static_cast<std::int64_t>(1000 * settings.request_timeout_s));

  std::promise<void> stop_asked;
  const StopSignals signals([&] { stop_asked.set_value(); });
  store::MemoryStore store;
  render::Pool pool(render::thread_limit(settings.threads, render::available_cores()), !settings.is_priority_normal);
  jobs::JobManager manager(settings.jobs, store, pool);
  http::Server server(settings.http, manager);
  address.port = server.start();
  std::cout << "listening on " << url_of(address) << std::endl;
  spdlog::info("{} render threads, {} jobs at once, {} may wait", pool.size(), settings.jobs.jobs,
               settings.jobs.max_queued);

  stop_asked.get_future().wait();
  spdlog::info("stopping");
  manager.stop();
  server.stop();
  spdlog::info("stopped");
  return status_done;
}

void add_flags(CLI::App& command, Settings& settings) {
  command.add_option("--listen", settings.listen, "HOST:PORT; port 0 is any free one")->capture_default_str();
  command.add_flag("--allow-public", settings.is_public_allowed, "Listen where other machines can reach it");
  add_threads_flag(command, settings.threads);
  command.add_option("--jobs", settings.jobs.jobs, "Jobs that render at once")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  command.add_option("--queue", settings.jobs.max_queued, "Jobs that wait at most")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command.add_option("--store", settings.store, "Where jobs are kept; in this version always in memory")
      ->type_name("DIR");
  command.add_option("--job-time-limit", settings.job_time_limit_s, "Seconds a render may take; 0 is any time")
      ->check(CLI::NonNegativeNumber)
      ->type_name("S")
      ->capture_default_str();
  command.add_option("--keep-jobs", settings.jobs.retention.max_jobs, "Finished jobs that are remembered")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      .add_option("--keep-images", settings.jobs.retention.max_image_bytes, "Bytes of finished images that are kept")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("BYTES")
      ->capture_default_str();
  command.add_option("--max-streams", settings.http.max_event_streams, "Event streams open at once")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  command.add_option("--request-timeout", settings.request_timeout_s, "Seconds in which a request must arrive")
      ->check(CLI::Range(0.1, 3600.0))
      ->type_name("S")
      ->capture_default_str();
  command.add_flag("--normal-priority", settings.is_priority_normal,
                   "Render threads compete with everything else instead of giving way");
  command.add_option("--log-level", settings.log_level, "What goes to standard error")
      ->check(CLI::IsMember({"debug", "info", "warning", "error", "off"}))
      ->capture_default_str();
  add_limit_flags(command, settings.jobs.limits);
}

}  // namespace

Command add_serve(CLI::App& program) {
  const auto settings = std::make_shared<Settings>();
  CLI::App* command = program.add_subcommand("serve", "Answer HTTP: queue jobs, render them, stream their progress");
  add_flags(*command, *settings);
  add_environment_twins(*command);
  return {command, [settings] { return serve(*settings); }};
}

}  // namespace penumbra::cli
