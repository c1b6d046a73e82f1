#include <doctest/doctest.h>

#include <algorithm>
#include <future>
#include <set>

#include "engine/system/pool.h"
#include "server/jobs/retention_clock.h"
#include "tests/server/fixture.h"

// What is kept, for whom, and what a key or a claim stands for meanwhile.

using nlohmann::json;
using namespace penumbra;
using namespace std::chrono_literals;

namespace {

jobs::Settings one_at_a_time() {
  jobs::Settings settings;
  settings.jobs = 1;
  return settings;
}

}  // namespace

TEST_CASE("retention takes nothing that a call waits for") {
  jobs::Settings settings;
  SUBCASE("no image is kept") { settings.retention.max_image_bytes = 0; }
  SUBCASE("one job is kept") { settings.retention.max_jobs = 1; }
  SUBCASE("nothing grows old") { settings.retention.image_age = settings.retention.job_age = -3600s; }
  const TestServer server(settings);
  std::vector<std::future<int>> calls;
  for (int client = 0; client < 4; ++client) {
    calls.push_back(std::async(std::launch::async, [&] {
      int good = 0;
      for (int i = 0; i < 10; ++i) {
        // Every other one has the image of the one before, if that is still there.
        const std::string body = i % 2 == 0 ? another_job() : small_job();
        const Reply reply = post(server.port(), "/v1/render", body);
        good += reply.status == 200 && reply.body.starts_with("\x89PNG") ? 1 : 0;
      }
      return good;
    }));
  }
  for (std::future<int>& call : calls) CHECK(call.get() == 10);
}

TEST_CASE("what a call has waited for goes once it has its answer") {
  jobs::Settings settings;
  settings.retention.max_image_bytes = 0;
  const TestServer server(settings);
  const Reply reply = post(server.port(), "/v1/render", small_job());
  CHECK(reply.status == 200);
  const std::string image = reply.headers.at("content-location");
  CHECK(eventually([&] { return call(server.port(), "GET", image).status == 410; }));
}

TEST_CASE("a key is free from the moment a cancel is accepted") {
  const TestServer server(one_at_a_time());
  const std::string key = "Idempotency-Key: one\r\n";
  std::set<std::string> ids;
  for (int i = 0; i < 20; ++i) {
    // Another body each time, so that a key that is still taken is a conflict.
    const Reply accepted = post(server.port(), "/v1/jobs", endless_job(fresh_seed()), key);
    REQUIRE(accepted.status == 202);
    const std::string id = json::parse(accepted.body).at("id");
    CHECK(ids.insert(id).second);
    if (i % 2 == 0) REQUIRE(server.reaches(id, "running"));
    CHECK(call(server.port(), "POST", "/v1/jobs/" + id + "/cancel").status == 200);
  }
}

TEST_CASE("the same body with the key of a job that is being canceled makes another job") {
  const TestServer server(one_at_a_time());
  const std::string body = endless_job(), key = "Idempotency-Key: one\r\n";
  const std::string first = json::parse(post(server.port(), "/v1/jobs", body, key).body).at("id");
  REQUIRE(server.reaches(first, "running"));
  CHECK(call(server.port(), "POST", "/v1/jobs/" + first + "/cancel").status == 200);
  const json second = json::parse(post(server.port(), "/v1/jobs", body, key).body);
  CHECK(second.at("id") != first);
  CHECK(server.reaches(second.at("id"), "running"));
  CHECK(server.state_of(first) == "canceled");
}

TEST_CASE("concurrent repeats of a call are one job, however little room there is") {
  jobs::Settings settings = one_at_a_time();
  settings.max_queued = 1;
  const TestServer server(settings);
  const std::string running = server.submit(endless_job());
  REQUIRE(server.reaches(running, "running"));
  for (int round = 0; round < 5; ++round) {
    const std::string body = another_job(), key = "Idempotency-Key: " + std::to_string(round) + "\r\n";
    std::vector<std::future<Reply>> calls;
    for (int i = 0; i < 8; ++i)
      calls.push_back(std::async(std::launch::async, [&] { return post(server.port(), "/v1/jobs", body, key); }));
    std::set<std::string> ids;
    for (std::future<Reply>& each : calls) {
      const Reply reply = each.get();
      CHECK(reply.status == 202);
      if (reply.status == 202) ids.insert(json::parse(reply.body).at("id"));
    }
    REQUIRE(ids.size() == 1);
    call(server.port(), "DELETE", "/v1/jobs/" + *ids.begin());
  }
}

TEST_CASE(
    "after a restart the last who waits for a job cancels it by leaving, unless somebody wants it without waiting") {
  TestStore store;
  system::Pool pool(1);
  const std::string body = endless_job();
  std::string awaited, wanted;
  {
    jobs::JobManager manager(one_at_a_time(), store, pool);
    awaited = manager.submit(body, "awaited", {"", {}, true}).job.id;
    wanted = manager.submit(endless_job(fresh_seed()), "wanted", {"", {}, false}).job.id;
  }
  jobs::JobManager manager(one_at_a_time(), store, pool);
  CHECK(manager.submit(body, "awaited", {"", {}, true}).job.id == awaited);
  CHECK(manager.submit(body, "awaited", {"", {}, true}).job.id == awaited);
  manager.give_up(awaited);
  CHECK(manager.find(awaited)->state != api::JobState::canceled);
  manager.give_up(awaited);
  CHECK(eventually([&] { return manager.find(awaited)->state == api::JobState::canceled; }));
  CHECK(eventually([&] { return manager.find(wanted)->state == api::JobState::running; }));
}

TEST_CASE("a clock that is wrong for a moment ages nothing, and one that was set is followed") {
  const api::Time noon = api::Time(500'000h);
  const jobs::Clock::time_point start;
  jobs::RetentionClock clock(noon, start);
  CHECK(clock.tell(noon + 10s, start + 10s) == noon + 10s);
  for (const auto jump : {24h * 365, -24h * 365}) CHECK(clock.tell(noon + 20s + jump, start + 20s) == noon + 20s);
  CHECK(clock.tell(noon + 31s, start + 30s) == noon + 31s);
  const auto elsewhere = noon + 1000h;
  CHECK(clock.tell(elsewhere, start + 40s) == noon + 41s);
  CHECK(clock.tell(elsewhere + 59min, start + 40s + 59min) == noon + 41s + 59min);
  CHECK(clock.tell(elsewhere + 61min, start + 40s + 61min) == elsewhere + 61min);
  CHECK(clock.tell(elsewhere + 62min, start + 40s + 62min) == elsewhere + 62min);
}
