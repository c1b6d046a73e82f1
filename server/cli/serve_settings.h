#pragma once
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/options.h"
#include "server/cli/address.h"
#include "server/http/server.h"
#include "server/jobs/job_manager.h"
#include "server/store/sqlite_store.h"

namespace CLI {
class App;
}

namespace penumbra::cli {

/// What the flags of `penumbra serve` say.
struct ServeSettings {
  std::vector<std::string> hosts;
  std::string listen = "127.0.0.1:8080", admin_listen, store, keys, log_level = "info", log_format = "json";
  bool is_public_allowed = false, is_priority_normal = false;
  int threads = scene::all_threads;
  double request_timeout_s = 30, idle_timeout_s = 15, job_time_limit_s = 0;
  std::size_t max_jobs_of_key = 64;  // 0: any number
  double keep_jobs_days = 7, keep_images_hours = 24;
  std::uint64_t disk_reserve_bytes = store::SqliteSettings().disk_reserve_bytes;
  jobs::Settings jobs;
  http::ServerSettings http;  // what the flags above say of it is filled in by `complete`

  ServeSettings();
};

void add_serve_flags(CLI::App& command, ServeSettings& settings);

/// A complaint about the flags, if there is one.
std::optional<std::string> complaint_about(const ServeSettings& settings);

/// Fills in what follows from the flags; they must be without complaint.
void complete(ServeSettings& settings);

}  // namespace penumbra::cli
