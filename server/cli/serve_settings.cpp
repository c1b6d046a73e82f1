#include "server/cli/serve_settings.h"

#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "server/cli/flags.h"
#include "server/cli/machine_memory.h"
#include "server/cli/origin.h"
#include "server/http/host.h"

namespace penumbra::cli {

namespace {

// Beside event streams and calls that wait for their image; descriptors beside connections.
constexpr std::size_t spare_connections = 256, spare_descriptors = 64, admin_connections = 64, least_connections = 8;

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(1000 * seconds));
}

std::optional<std::string> complaint_about_address(const std::string& flag, const std::string& text,
                                                   bool is_public_fine, const std::string& why_not) {
  const std::optional<Address> address = parse_address(text);
  if (!address) return flag + ": " + text + " is not HOST:PORT";
  if (!http::is_loopback(address->host) && !is_public_fine)
    return flag + ": others can reach " + address->host + ", and " + why_not + "; --allow-public if that is meant";
  return std::nullopt;
}

/// As a request's Host names it; nothing when it is none.
std::optional<std::string> host_of(const std::string& text) {
  const bool is_bare_v6 = text.find(':') != std::string::npos && !text.starts_with('[');
  return text.ends_with(':') ? std::nullopt : http::host_in(is_bare_v6 ? "[" + text + "]" : text);
}

/// Browsers compare origins letter by letter.
std::optional<std::string> complaint_about_origin(const std::string& text) {
  if (text == "*" || text == "null") return std::nullopt;
  const std::optional<std::string> origin = origin_of(text);
  if (!origin) return "--cors-origin: " + text + " is not an origin such as https://example.org";
  if (*origin != text) return "--cors-origin: browsers write the origin " + text + " as " + *origin;
  return std::nullopt;
}

void add_access_flags(CLI::App& command, ServeSettings& settings) {
  const auto add = [&](const char* name, auto& value, const char* description) {
    return command.add_option(name, value, description)->group("Access");
  };
  add("--keys", settings.keys, "The file of keys (`penumbra key`); without it nobody is asked for one")
      ->type_name("FILE");
  add("--key-requests", settings.http.guard.requests_per_minute, "Requests a minute of each key; 0 is any number")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  add("--key-jobs", settings.max_jobs_of_key, "Unfinished jobs of each owner of keys; 0 is any number")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  add("--cors-origin", settings.http.guard.origins, "Sites whose pages may call, such as https://example.org; * is all")
      ->delimiter(',')
      ->type_name("ORIGIN");
  add("--host", settings.hosts,
      "Names that the server answers to, beside those of this machine; any where there are keys")
      ->delimiter(',')
      ->type_name("NAME");
  command
      .add_flag("--allow-public", settings.is_public_allowed, "Listen without keys where other machines can reach it")
      ->group("Access");
}

void add_connection_flags(CLI::App& command, ServeSettings& settings) {
  const auto add = [&](const char* name, auto& value, const char* description) {
    return command.add_option(name, value, description)->capture_default_str()->group("Limits of a connection");
  };
  http::ServerSettings& http = settings.http;
  add("--max-connections", http.listener.max_connections, "Connections open at once; 0 is what streams and queue need")
      ->check(CLI::Range(0, 100'000));
  add("--max-streams", http.streams.all, "Event streams open at once")->check(CLI::Range(1, 10'000));
  add("--max-client-streams", http.streams.of_one_client, "Event streams of one key, or of one address")
      ->check(CLI::Range(1, 10'000));
  add("--max-head", http.listener.connection.max_head_bytes, "Largest request line and header fields")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(1'024, 1 << 20))
      ->type_name("BYTES");
  require_finite(add("--request-timeout", settings.request_timeout_s, "Seconds in which a request must arrive"))
      ->check(CLI::Range(0.1, 3600.0))
      ->type_name("S");
  require_finite(add("--idle-timeout", settings.idle_timeout_s, "Seconds a connection is kept between requests"))
      ->check(CLI::Range(0.1, 3600.0))
      ->type_name("S");
}

void add_job_flags(CLI::App& command, ServeSettings& settings) {
  command.add_option("--jobs", settings.jobs.jobs, "Jobs that render at once")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  command.add_option("--queue", settings.jobs.max_queued, "Jobs that wait at most")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command.add_option("--queue-bytes", settings.jobs.max_queued_bytes, "Bytes of the bodies of waiting jobs at most")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("BYTES")
      ->capture_default_str();
  command
      .add_option("--store", settings.store,
                  "The directory jobs are kept in; else $XDG_STATE_HOME/penumbra or ~/.local/state/penumbra")
      ->type_name("DIR");
  require_finite(
      command.add_option("--job-time-limit", settings.job_time_limit_s, "Seconds a render may take; 0 is any time"))
      ->check(CLI::NonNegativeNumber)
      ->type_name("S")
      ->capture_default_str();
}

void add_keeping_flags(CLI::App& command, ServeSettings& settings) {
  const auto add = [&](const char* name, auto& value, const char* description) {
    return command.add_option(name, value, description)->capture_default_str()->group("What is kept");
  };
  store::Retention& retention = settings.jobs.retention;
  add("--keep-jobs", retention.max_jobs, "Finished jobs that are remembered")->check(CLI::PositiveNumber);
  require_finite(add("--keep-jobs-days", settings.keep_jobs_days, "Days for which they are"))
      ->check(CLI::PositiveNumber);
  add("--keep-images", retention.max_image_bytes, "Bytes of finished images that are kept")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("BYTES");
  add("--keep-scenes", retention.max_spec_bytes, "Bytes of finished jobs' bodies that are kept")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("BYTES");
  require_finite(add("--keep-images-hours", settings.keep_images_hours, "Hours for which they are"))
      ->check(CLI::PositiveNumber);
  add("--disk-reserve", settings.disk_reserve_bytes, "No new jobs when the disk has fewer free bytes")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("BYTES");
}

/// Where this user's jobs are kept when nobody says otherwise (XDG Base Directory Specification); empty when there is
/// no such place.
std::string default_store() {
  const auto value_of = [](const char* name) {
    // Before there is a second thread. NOLINTNEXTLINE(concurrency-mt-unsafe)
    const char* const value = std::getenv(name);
    return std::string(value != nullptr ? value : "");
  };
  // The specification wants relative paths ignored.
  if (const std::string state = value_of("XDG_STATE_HOME"); state.starts_with('/')) return state + "/penumbra";
  if (const std::string home = value_of("HOME"); home.starts_with('/')) return home + "/.local/state/penumbra";
  return "";
}

std::chrono::seconds whole_seconds(double seconds) {
  return std::chrono::seconds(static_cast<std::int64_t>(std::min(seconds, 1e9)));
}

/// One for every connection that may be open, as far as the system lets us: returns how many.
std::size_t raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return 1024;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  return static_cast<std::size_t>(limit.rlim_cur);
}

}  // namespace

ServeSettings::ServeSettings() {
  http.listener.max_connections = 0;
  const std::size_t machine = machine_memory_bytes();
  if (machine == 0) return;
  // Of a machine or container that has less than twice the usual limit, half goes to one job; a quarter is left for
  // everything but renders, half of that for bodies.
  jobs.limits.max_memory_bytes = std::min(jobs.limits.max_memory_bytes, machine / 2);
  http.listener.max_held_body_bytes = machine / 8;
  jobs.max_running_bytes = machine / 4 * 3;
}

void add_serve_flags(CLI::App& command, ServeSettings& settings) {
  command.add_option("--listen", settings.listen, "HOST:PORT; port 0 is any free one")->capture_default_str();
  command.add_option("--admin-listen", settings.admin_listen,
                     "A second HOST:PORT for /healthz, /readyz and /metrics, without keys");
  add_threads_flag(command, settings.threads);
  add_job_flags(command, settings);
  add_keeping_flags(command, settings);
  command.add_flag("--normal-priority", settings.is_priority_normal,
                   "Render threads compete with everything else instead of giving way");
  command.add_option("--log-level", settings.log_level, "What goes to standard error; requests are of level info")
      ->check(CLI::IsMember({"debug", "info", "warning", "error", "off"}))
      ->capture_default_str();
  command.add_option("--log-format", settings.log_format, "A JSON object a line, or text")
      ->check(CLI::IsMember({"json", "text"}))
      ->capture_default_str();
  add_access_flags(command, settings);
  add_connection_flags(command, settings);
  add_limit_flags(command, settings.jobs.limits);
}

std::optional<std::string> complaint_about(const ServeSettings& settings) {
  if (auto complaint =
          complaint_about_address("--listen", settings.listen, settings.is_public_allowed || !settings.keys.empty(),
                                  "no keys are asked for (--keys)"))
    return complaint;
  if (!settings.admin_listen.empty()) {
    if (auto complaint = complaint_about_address("--admin-listen", settings.admin_listen, settings.is_public_allowed,
                                                 "it never asks for keys"))
      return complaint;
  }
  for (const std::string& origin : settings.http.guard.origins) {
    if (auto complaint = complaint_about_origin(origin)) return complaint;
  }
  for (const std::string& host : settings.hosts) {
    if (!host_of(host)) return "--host: " + host + " is not the name of a host, such as render.example.org";
  }
  if (settings.store.starts_with("postgresql://") || settings.store.starts_with("postgres://"))
    return "--store: the PostgreSQL store is not part of this version";
  if (settings.store.empty() && default_store().empty())
    return "--store: there is no home directory to keep jobs in; name a directory";
  return std::nullopt;
}

void complete(ServeSettings& settings) {
  if (settings.store.empty()) settings.store = default_store();
  settings.jobs.retention.job_age = whole_seconds(24 * 3600 * settings.keep_jobs_days);
  settings.jobs.retention.image_age = whole_seconds(3600 * settings.keep_images_hours);
  if (settings.job_time_limit_s > 0) settings.jobs.time_limit_s = settings.job_time_limit_s;
  if (settings.max_jobs_of_key > 0) settings.http.guard.max_jobs = settings.max_jobs_of_key;
  settings.http.access_log = settings.log_format == "json" ? log::Format::json : log::Format::text;

  http::ListenerSettings& listener = settings.http.listener;
  const Address address = *parse_address(settings.listen);
  listener.host = address.host;
  listener.port = address.port;
  listener.connection.max_body_bytes = settings.jobs.limits.max_body_bytes;
  listener.connection.request = milliseconds(settings.request_timeout_s);
  listener.connection.idle = milliseconds(settings.idle_timeout_s);
  if (listener.max_connections == 0) {
    listener.max_connections = settings.http.streams.all + settings.jobs.max_queued +
                               static_cast<std::size_t>(settings.jobs.jobs) + spare_connections;
  }
  // More could be accepted only by taking the descriptors of files and of the second address.
  const std::size_t descriptors = raise_descriptor_limit(), reserved = admin_connections + spare_descriptors;
  const std::size_t most = std::max(descriptors, reserved + least_connections) - reserved;
  listener.max_connections = std::min(listener.max_connections, most);

  std::vector<std::string> names;
  for (const std::string& host : settings.hosts) names.push_back(*host_of(host));
  if (!names.empty() || settings.keys.empty())
    settings.http.guard.hosts = http::KnownHosts(names, !http::is_loopback(address.host));
  if (settings.admin_listen.empty()) return;
  const Address admin = *parse_address(settings.admin_listen);
  settings.http.admin = http::ListenerSettings{admin.host, admin.port, admin_connections, listener.connection};
  // What only numbers can be read from may have any name where it is public.
  if (http::is_loopback(admin.host)) settings.http.admin_hosts = http::KnownHosts(names, false);
}

}  // namespace penumbra::cli
