#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "server/http/server.h"
#include "server/jobs/job_manager.h"
#include "server/store/sqlite_store.h"
#include "server/store/timed_store.h"
#include "tests/server/client.h"
#include "tests/support/temporary_directory.h"

/// A store in a directory of its own.
class TestStore : penumbra::test::TemporaryDirectory, public penumbra::store::SqliteStore {
 public:
  explicit TestStore(std::uint64_t disk_reserve_bytes = 0);
};

/// A whole server in this process, on a free port.
class TestServer {
 public:
  explicit TestServer(const penumbra::jobs::Settings& jobs = {}, penumbra::http::ServerSettings http = {});
  ~TestServer();

  int port() const { return ports_.main; }
  const std::vector<penumbra::http::Route>& routes() const { return server_.routes(); }
  int admin_port() const { return ports_.admin; }
  penumbra::jobs::JobManager& manager() { return manager_; }

  nlohmann::json job(const std::string& id) const;
  std::string state_of(const std::string& id) const { return job(id).at("state"); }
  /// Posts a job and returns its id.
  std::string submit(const std::string& body) const;
  /// Waits until the job is in this state.
  bool reaches(const std::string& id, std::string_view state) const;

 private:
  penumbra::metrics::Metrics metrics_;
  TestStore store_;
  penumbra::store::TimedStore timed_store_;
  penumbra::system::Pool pool_;
  penumbra::jobs::JobManager manager_;
  penumbra::http::Server server_;
  penumbra::http::Server::Ports ports_;
};

/// Whether `is_so` becomes true within half a minute.
bool eventually(const std::function<bool()>& is_so);

/// Another seed each time, so that the job has an image that no other has.
std::string fresh_seed();

/// A sphere under a light; `options` are JSON members such as R"("width": 16)".
std::string small_job(std::string_view options = R"("width": 16, "height": 16)");
/// The same with an image that no other job has.
std::string another_job();
/// The same for minutes. `more` are further options, each after a comma.
std::string endless_job(std::string_view more = "");
