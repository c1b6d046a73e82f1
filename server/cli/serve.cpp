#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <future>
#include <iostream>
#include <memory>
#include <mutex>

#include "engine/render/render.h"
#include "server/cli/address.h"
#include "server/cli/command.h"
#include "server/cli/flags.h"
#include "server/cli/stop_signals.h"
#include "server/http/server.h"
#include "server/jobs/job_manager.h"
#include "server/jobs/spec_hash.h"
#include "server/store/sqlite_store.h"

namespace penumbra::cli {

namespace {

constexpr std::size_t spare_connections = 256;  // beside event streams and calls that wait for their image

struct Settings {
  std::string listen = "127.0.0.1:8080", store, log_level = "info";
  bool is_public_allowed = false, is_priority_normal = false;
  int threads = scene::all_threads;
  double request_timeout_s = 30, job_time_limit_s = 0;
  double keep_jobs_days = 7, keep_images_hours = 24;
  std::uint64_t disk_reserve_bytes = store::SqliteSettings().disk_reserve_bytes;
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

/// Where this user's jobs are kept when nobody says otherwise (XDG Base Directory Specification); empty when there is
/// no such place.
std::string default_store() {
  const auto value_of = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value != nullptr ? value : "");
  };
  // The specification wants relative paths ignored.
  if (const std::string state = value_of("XDG_STATE_HOME"); state.starts_with('/')) return state + "/penumbra";
  if (const std::string home = value_of("HOME"); home.starts_with('/')) return home + "/.local/state/penumbra";
  return "";
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

/// A complaint about the arguments, if there is one.
std::optional<std::string> complaint_about(const Settings& settings) {
  const std::optional<Address> address = parse_address(settings.listen);
  if (!address) return "--listen: " + settings.listen + " is not HOST:PORT";
  if (!is_loopback(address->host) && !settings.is_public_allowed)
    return "--listen: others can reach " + address->host +
           ", and no keys are asked for; --allow-public if that is meant";
  if (settings.store.starts_with("postgresql://") || settings.store.starts_with("postgres://"))
    return "--store: the PostgreSQL store is not part of this version";
  if (settings.store.empty()) return "--store: there is no home directory to keep jobs in; name a directory";
  return std::nullopt;
}

std::chrono::seconds whole_seconds(double seconds) {
  return std::chrono::seconds(static_cast<std::int64_t>(std::min(seconds, 1e9)));
}

int serve(Settings settings) {
  if (settings.store.empty()) settings.store = default_store();
  if (const auto complaint = complaint_about(settings)) {
    std::cerr << "penumbra serve: " << *complaint << "\n";
    return status_unusable;
  }
  configure_log(settings.log_level);
  raise_descriptor_limit();

  Address address = *parse_address(settings.listen);
  settings.jobs.retention.job_age = whole_seconds(24 * 3600 * settings.keep_jobs_days);
  settings.jobs.retention.image_age = whole_seconds(3600 * settings.keep_images_hours);
  if (settings.job_time_limit_s > 0) settings.jobs.time_limit_s = settings.job_time_limit_s;
  settings.http.host = address.host;
  settings.http.port = address.port;
  settings.http.max_connections = settings.http.max_event_streams + settings.jobs.max_queued +
                                  static_cast<std::size_t>(settings.jobs.jobs) + spare_connections;
  settings.http.connection.max_body_bytes = settings.jobs.limits.max_body_bytes;
  settings.http.connection.request =
      std::chrono::milliseconds(static_cast<std::int64_t>(1000 * settings.request_timeout_s));

  End end;
  const StopSignals signals([&] { end.ask(status_done); });
  store::SqliteStore store(
      {settings.store, jobs::engine_version(), settings.disk_reserve_bytes, [&](const char* reason) {
         spdlog::critical("the store has failed, the server ends: {}", reason);
         end.ask(status_failed);
       }});
  render::Pool pool(render::thread_limit(settings.threads, render::available_cores()), !settings.is_priority_normal);
  jobs::JobManager manager(settings.jobs, store, pool);
  http::Server server(settings.http, manager);
  address.port = server.start();
  std::cout << "listening on " << url_of(address) << std::endl;
  spdlog::info("{} render threads, {} jobs at once, {} may wait; jobs are kept in {}", pool.size(), settings.jobs.jobs,
               settings.jobs.max_queued, settings.store);

  const int status = end.wait();
  spdlog::info("stopping");
  manager.stop();
  server.stop();
  spdlog::info("stopped");
  return status;
}

void add_keeping_flags(CLI::App& command, Settings& settings) {
  const auto add = [&](const char* name, auto& value, const char* description) {
    return command.add_option(name, value, description)->capture_default_str()->group("What is kept");
  };
  store::Retention& retention = settings.jobs.retention;
  add("--keep-jobs", retention.max_jobs, "Finished jobs that are remembered")->check(CLI::PositiveNumber);
  add("--keep-jobs-days", settings.keep_jobs_days, "Days for which they are")->check(CLI::PositiveNumber);
  add("--keep-images", retention.max_image_bytes, "Bytes of finished images that are kept")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("BYTES");
  add("--keep-images-hours", settings.keep_images_hours, "Hours for which they are")->check(CLI::PositiveNumber);
  add("--disk-reserve", settings.disk_reserve_bytes, "No new jobs when the disk has fewer free bytes")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("BYTES");
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
  command
      .add_option("--store", settings.store,
                  "The directory jobs are kept in; else $XDG_STATE_HOME/penumbra or ~/.local/state/penumbra")
      ->type_name("DIR");
  command.add_option("--job-time-limit", settings.job_time_limit_s, "Seconds a render may take; 0 is any time")
      ->check(CLI::NonNegativeNumber)
      ->type_name("S")
      ->capture_default_str();
  add_keeping_flags(command, settings);
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
