#include "tests/server/fixture.h"

#include <atomic>
#include <chrono>
#include <thread>

using namespace penumbra;

namespace {

http::ServerSettings on_free_port(http::ServerSettings settings) {
  settings.listener.port = 0;
  return settings;
}

jobs::Settings with_metrics(jobs::Settings settings, metrics::Metrics& metrics) {
  settings.on_start = [&](double waited_s) { metrics.job_started(waited_s); };
  settings.on_image = [&](const render::Stats& stats) { metrics.image_rendered(stats); };
  return settings;
}

}  // namespace

TestStore::TestStore(std::uint64_t disk_reserve_bytes)
    : SqliteStore({path(), "test", disk_reserve_bytes, [](const char*) {}}) {}

TestServer::TestServer(const jobs::Settings& jobs, http::ServerSettings http)
    : timed_store_(store_, [this](auto operation, double took_s) { metrics_.store_called(operation, took_s); }),
      pool_(2),
      manager_(with_metrics(jobs, metrics_), timed_store_, pool_),
      server_(on_free_port(std::move(http)), manager_, metrics_),
      ports_(server_.start()) {}

TestServer::~TestServer() {
  manager_.stop();
  server_.stop();
}

nlohmann::json TestServer::job(const std::string& id) const {
  return nlohmann::json::parse(call(port(), "GET", "/v1/jobs/" + id).body);
}

std::string TestServer::submit(const std::string& body) const {
  const Reply reply = post(port(), "/v1/jobs", body);
  if (reply.status != 202) throw std::runtime_error("not accepted: " + reply.body);
  return nlohmann::json::parse(reply.body).at("id");
}

bool TestServer::reaches(const std::string& id, std::string_view state) const {
  return eventually([&] { return state_of(id) == state; });
}

bool eventually(const std::function<bool()>& is_so) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!is_so()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

std::string fresh_seed() {
  static std::atomic<int> next = 1000;
  return R"(, "seed": )" + std::to_string(next++);
}

std::string small_job(std::string_view options) {
  const std::string scene = R"({"scene": {
    "camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40},
    "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}],
    "lights": [{"type": "point", "position": [3, 4, 5], "intensity": 1}]}, "options": {)";
  return scene + std::string(options) + "}}";
}

std::string another_job() { return small_job(R"("width": 16, "height": 16)" + fresh_seed()); }

std::string endless_job(std::string_view more) {
  return small_job(R"("width": 1200, "height": 1200, "samples_per_pixel": 1024)" + std::string(more));
}
