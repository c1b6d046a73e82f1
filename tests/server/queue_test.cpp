#include <doctest/doctest.h>

#include <atomic>
#include <future>
#include <thread>

#include "engine/system/pool.h"
#include "tests/server/fixture.h"

using nlohmann::json;
using namespace penumbra;

namespace {

jobs::Settings settings_for(int at_once, std::size_t queued) {
  jobs::Settings settings;
  settings.jobs = at_once;
  settings.max_queued = queued;
  return settings;
}

/// A store whose disk may take no more ends.
class FullStore : public store::TimedStore {
 public:
  using store::TimedStore::TimedStore;
  bool finish(const std::string& id, store::Ending ending) override {
    if (is_full) throw store::StorageFull();
    return store::TimedStore::finish(id, std::move(ending));
  }
  std::atomic<bool> is_full = false;
};

}  // namespace

TEST_CASE("a full disk keeps a waiting job's cancel from being stored, and nobody waiting for it") {
  TestStore kept;
  FullStore store(kept, [](std::string_view, double) {});
  system::Pool pool(1);
  jobs::JobManager manager(settings_for(1, 10), store, pool);
  const std::string running = manager.submit(endless_job(), {}).job.id,
                    waiting = manager.submit(another_job(), {}).job.id;
  REQUIRE(eventually([&] { return manager.find(running)->state == api::JobState::running; }));
  store.is_full = true;
  CHECK_THROWS_AS(manager.cancel(waiting), store::StorageFull);
  CHECK_THROWS_AS(manager.remove(waiting), store::StorageFull);
  CHECK(manager.find(waiting)->state == api::JobState::queued);
  CHECK(manager.find(waiting)->queue_position == 1);
  store.is_full = false;
  manager.cancel(running);
  CHECK(eventually([&] { return manager.find(waiting)->state == api::JobState::succeeded; }));
}

TEST_CASE("a full disk and a cancel under way end no server that stops") {
  TestStore kept;
  FullStore store(kept, [](std::string_view, double) {});
  system::Pool pool(1);
  jobs::JobManager manager(settings_for(1, 10), store, pool);
  const std::string running = manager.submit(endless_job(), {}).job.id;
  REQUIRE(eventually([&] { return manager.find(running)->percent > 0; }));
  store.is_full = true;
  manager.cancel(running);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  manager.stop();
  CHECK(kept.find(running)->state == api::JobState::queued);
}

TEST_CASE("a full queue answers 429 and harms nobody who is in it") {
  const TestServer server(settings_for(1, 2));
  const std::string running = server.submit(endless_job());
  REQUIRE(server.reaches(running, "running"));
  const std::string first = server.submit(another_job()), second = server.submit(another_job());
  for (const char* path : {"/v1/jobs", "/v1/render"}) {
    const Reply refused = post(server.port(), path, another_job());
    CHECK(refused.status == 429);
    CHECK(json::parse(refused.body).at("type") == "/problems/queue-full");
    CHECK(std::stoi(refused.headers.at("retry-after")) >= 1);
  }
  CHECK(server.state_of(first) == "queued");
  call(server.port(), "POST", "/v1/jobs/" + running + "/cancel");
  CHECK(server.reaches(first, "succeeded"));
  CHECK(server.reaches(second, "succeeded"));
  CHECK(post(server.port(), "/v1/render", another_job()).status == 200);
}

TEST_CASE("without a queue a job still runs when nothing else does") {
  const TestServer server(settings_for(1, 0));
  CHECK(post(server.port(), "/v1/render", small_job()).status == 200);
  const std::string running = server.submit(endless_job());
  CHECK(post(server.port(), "/v1/jobs", small_job()).status == 429);
  call(server.port(), "DELETE", "/v1/jobs/" + running);
}

TEST_CASE("the bodies of waiting jobs have a budget too") {
  jobs::Settings settings = settings_for(1, 100);
  settings.max_queued_bytes = 1000;
  const TestServer server(settings);
  const std::string running = server.submit(endless_job());
  REQUIRE(server.reaches(running, "running"));
  int accepted = 0;
  while (post(server.port(), "/v1/jobs", another_job()).status == 202) ++accepted;
  CHECK(accepted >= 1);
  CHECK(accepted < 10);
}

TEST_CASE("what needs more memory than is left waits in the queue") {
  jobs::Settings settings = settings_for(3, 10);
  settings.max_running_bytes = 1;  // for one at a time, whatever it needs
  const TestServer server(settings);
  const std::string running = server.submit(endless_job());
  REQUIRE(server.reaches(running, "running"));
  const std::string first = server.submit(another_job()), second = server.submit(another_job());
  CHECK(server.job(first).at("queue_position") == 1);
  CHECK(server.job(second).at("queue_position") == 2);
  call(server.port(), "POST", "/v1/jobs/" + second + "/cancel");
  CHECK(server.state_of(second) == "canceled");
  call(server.port(), "POST", "/v1/jobs/" + running + "/cancel");
  REQUIRE(server.reaches(first, "succeeded"));
}

TEST_CASE("renders found in the store wait for memory too") {
  TestStore store;
  system::Pool pool(1);
  std::vector<std::string> ids;
  {
    jobs::JobManager manager(settings_for(1, 10), store, pool);
    for (const std::string& body : {endless_job(), another_job(), another_job()})
      ids.push_back(manager.submit(body, std::nullopt).job.id);
  }
  jobs::Settings settings = settings_for(3, 10);
  settings.max_running_bytes = 1;
  jobs::JobManager manager(settings, store, pool);
  const auto state = [&](const std::string& id) { return manager.find(id)->state; };
  REQUIRE(eventually([&] { return state(ids[0]) == api::JobState::running; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  CHECK(state(ids[1]) == api::JobState::queued);
  // One that waits for memory can be canceled.
  manager.cancel(ids[1]);
  CHECK(eventually([&] { return state(ids[1]) == api::JobState::canceled; }));
  manager.cancel(ids[0]);
  CHECK(eventually([&] { return state(ids[2]) == api::JobState::succeeded; }));
}

TEST_CASE("a job that shares a render waits where its own age puts it") {
  const TestServer server(settings_for(1, 10));
  const std::string running = server.submit(endless_job());
  REQUIRE(server.reaches(running, "running"));
  const std::string shared = another_job();
  const std::string oldest = server.submit(shared), older = server.submit(another_job()),
                    newest = server.submit(shared);
  CHECK(server.job(newest).at("queue_position") == 1);
  call(server.port(), "POST", "/v1/jobs/" + oldest + "/cancel");
  CHECK(server.job(older).at("queue_position") == 1);
  CHECK(server.job(newest).at("queue_position") == 2);
}

TEST_CASE("a job canceled out of a shared render keeps its percentage") {
  const TestServer server(settings_for(1, 10));
  const std::string body = endless_job(), one = server.submit(body), other = server.submit(body);
  const auto percent = [&](const std::string& id) { return server.job(id).at("progress").at("percent").get<double>(); };
  REQUIRE(eventually([&] { return percent(other) > 0; }));
  const double before = percent(other);
  call(server.port(), "POST", "/v1/jobs/" + other + "/cancel");
  CHECK(server.state_of(other) == "canceled");
  CHECK(percent(other) >= before);
  CHECK(server.state_of(one) == "running");
}

TEST_CASE("a job is canceled when the last of those who were answered with it gives it up") {
  TestStore store;
  system::Pool pool(1);
  jobs::JobManager manager(settings_for(1, 10), store, pool);
  const std::string body = endless_job();
  const std::string id = manager.submit(body, "one").job.id;
  CHECK(manager.submit(body, "one").job.id == id);
  CHECK(manager.submit(body, "one").outcome == jobs::Submission::Outcome::repeated);
  const auto is_canceled = [&] { return manager.find(id)->state == api::JobState::canceled; };
  manager.give_up(id);
  manager.give_up(id);
  CHECK_FALSE(is_canceled());
  manager.give_up(id);
  CHECK(eventually(is_canceled));
}

TEST_CASE("what is canceled while the server stops does not come back") {
  TestStore store;
  system::Pool pool(1);
  jobs::JobManager manager(settings_for(1, 10), store, pool);
  const std::string running = manager.submit(endless_job(), std::nullopt).job.id;
  const std::string queued = manager.submit(another_job(), std::nullopt).job.id;
  const std::string kept = manager.submit(another_job(), std::nullopt).job.id;
  REQUIRE(eventually([&] { return manager.find(running)->state == api::JobState::running; }));
  manager.stop();
  for (const std::string& id : {running, queued}) CHECK(manager.cancel(id)->state == api::JobState::canceled);
  CHECK(manager.find(kept)->state == api::JobState::queued);
  CHECK(store.unfinished().size() == 1);
}

TEST_CASE("higher priorities go first, equal ones in order") {
  const TestServer server(settings_for(1, 10));
  const std::string running = server.submit(endless_job());
  REQUIRE(server.reaches(running, "running"));
  const auto submit = [&](int priority) {
    return server.submit(
        small_job(R"("width": 8, "height": 8, "priority": )" + std::to_string(priority) + fresh_seed()));
  };
  const std::string low = submit(-5), usual = submit(0), later = submit(0), high = submit(50);
  CHECK(server.job(high).at("queue_position") == 1);
  CHECK(server.job(usual).at("queue_position") == 2);
  CHECK(server.job(later).at("queue_position") == 3);
  CHECK(server.job(low).at("queue_position") == 4);
  call(server.port(), "POST", "/v1/jobs/" + running + "/cancel");
  std::vector<std::string> starts;
  for (const std::string& id : {high, usual, later, low}) {
    REQUIRE(server.reaches(id, "succeeded"));
    starts.push_back(server.job(id).at("started_at"));
  }
  CHECK(std::is_sorted(starts.begin(), starts.end()));
}

TEST_CASE("many clients at once each get their image") {
  const TestServer server;
  const std::string expected = post(server.port(), "/v1/render", small_job()).body;
  std::atomic<int> good = 0;
  {
    std::vector<std::jthread> clients;
    for (int i = 0; i < 8; ++i) {
      clients.emplace_back([&] {
        Client client(server.port());
        for (int j = 0; j < 5; ++j) {
          const auto reply = client.request("POST", "/v1/render", small_job(), "Content-Type: application/json\r\n");
          if (reply && reply->status == 200 && reply->body == expected) ++good;
        }
      });
    }
  }
  CHECK(good == 40);
}

TEST_CASE("small jobs pass beside a large one") {
  const TestServer server(settings_for(2, 10));
  const std::string large = server.submit(endless_job());
  REQUIRE(server.reaches(large, "running"));
  CHECK(post(server.port(), "/v1/render", small_job()).status == 200);
  CHECK(server.state_of(large) == "running");
}

TEST_CASE("a job that takes longer than allowed fails with a reason") {
  jobs::Settings settings;
  settings.time_limit_s = 0.3;
  const TestServer server(settings);
  const std::string id = server.submit(endless_job());
  REQUIRE(server.reaches(id, "failed"));
  const json job = server.job(id);
  CHECK(job.at("error").at("type") == "/problems/time-limit");
  CHECK(job.at("progress").at("percent") < 100);
  const Reply waited = post(server.port(), "/v1/render", endless_job());
  CHECK(waited.status == 422);
  CHECK(json::parse(waited.body).at("type") == "/problems/time-limit");
}

TEST_CASE("what a store has left unfinished is taken up") {
  TestStore store;
  store::JobRecord record;
  record.id = "01JDF3Z4N6Q8R0S2T4V6X8Y0Z2";
  record.created_at = std::chrono::system_clock::now();
  store.create(record, small_job(), {});
  store::JobRecord invalid = record;
  invalid.id = "01JDF3Z4N6Q8R0S2T4V6X8Y0Z3";
  store.create(invalid, "{}", {});

  system::Pool pool(1);
  const jobs::JobManager manager({}, store, pool);
  CHECK(eventually([&] { return manager.find(record.id)->state == api::JobState::succeeded; }));
  CHECK(eventually([&] { return manager.find(invalid.id)->state == api::JobState::failed; }));
  CHECK(manager.find(invalid.id)->error->status == 422);
}

TEST_CASE("stopping leaves what is not done in the store and wakes whoever waits") {
  TestStore store;
  system::Pool pool(2);
  std::string running, queued;
  {
    jobs::JobManager manager(settings_for(1, 10), store, pool);
    running = manager.submit(endless_job(), {}).job.id;
    queued = manager.submit(small_job(), {}).job.id;
    REQUIRE(eventually([&] { return manager.find(running)->percent > 0; }));
    std::jthread waiter([&] {
      const auto job = manager.wait(queued, jobs::Clock::now() + std::chrono::seconds(30));
      CHECK(job->state == api::JobState::queued);
      CHECK(manager.is_stopping());
    });
    manager.stop();
    for (const std::string& id : {running, queued}) CHECK(manager.find(id)->state == api::JobState::queued);
    CHECK(manager.find(running)->percent > 0);
    CHECK(store.find(running)->crashes == 0);
    CHECK(manager.submit(small_job(), {}).outcome == jobs::Submission::Outcome::stopping);
  }
  jobs::JobManager next(settings_for(2, 10), store, pool);
  CHECK(next.find(running)->percent > 0);  // never falls
  CHECK(eventually([&] { return next.find(queued)->state == api::JobState::succeeded; }));
  CHECK(eventually([&] { return next.find(running)->state == api::JobState::running; }));
  CHECK(next.submit(small_job(R"("width": 8, "height": 8)"), {}).job.id > queued);
}

TEST_CASE("a job that joins a render while the server stops stays queued") {
  TestStore store;
  std::atomic<int> starts = 0;
  std::promise<void> joined, has_stopped;
  // The second start is stored, but the one who joins hears of it only when the server has stopped.
  store::TimedStore slow_store(store, [&](std::string_view operation, double) {
    if (operation != "start" || ++starts != 2) return;
    joined.set_value();
    has_stopped.get_future().wait_for(std::chrono::minutes(1));
  });
  system::Pool pool(2);
  jobs::JobManager manager(settings_for(1, 10), slow_store, pool);
  const std::string first = manager.submit(endless_job(), {}).job.id;
  REQUIRE(eventually([&] { return manager.find(first)->percent > 0; }));
  auto submission = std::async(std::launch::async, [&] { return manager.submit(endless_job(), {}); });
  REQUIRE(joined.get_future().wait_for(std::chrono::seconds(30)) == std::future_status::ready);
  manager.stop();
  has_stopped.set_value();
  const std::string second = submission.get().job.id;
  for (const std::string& id : {first, second}) CHECK(store.find(id)->state == api::JobState::queued);
}
