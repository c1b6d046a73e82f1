#include <doctest/doctest.h>

#include <chrono>

#include "tests/server/fixture.h"

using nlohmann::json;
using Clock = std::chrono::steady_clock;

namespace {

void open_events(Client& client, const std::string& id, const std::string& headers = "") {
  client.send("GET /v1/jobs/" + id + "/events HTTP/1.1\r\nHost: a\r\n" + headers + "\r\n");
  const auto head = client.head();
  REQUIRE(head);
  REQUIRE(head->status == 200);
  CHECK(head->headers.at("content-type") == "text/event-stream");
}

/// Renders for some seconds, in small steps.
std::string steady_job(const std::string& interval_s) {
  return small_job(R"("width": 1200, "height": 1200, "samples_per_pixel": 64, "progress_interval_s": )" + interval_s);
}

}  // namespace

TEST_CASE("progress comes at the asked interval, grows, and ends with the state") {
  const TestServer server;
  const std::string id = server.submit(steady_job("0.2"));
  Client client(server.port());
  open_events(client, id);
  std::vector<Clock::time_point> times;
  double last_percent = -1;
  long last_id = 0;
  for (int i = 0; i < 5; ++i) {
    const auto event = client.event();
    REQUIRE(event);
    times.push_back(Clock::now());
    CHECK(event->name == "progress");
    const json data = json::parse(event->data);
    CHECK(data.at("percent") >= last_percent);
    CHECK(data.at("percent") < 100);
    CHECK(std::stol(event->id) > last_id);
    last_percent = data.at("percent");
    last_id = std::stol(event->id);
  }
  // The server's clock decides; what is measured here may lag by a little.
  CHECK(times.back() - times.front() >= std::chrono::milliseconds(4 * 200 - 100));
  call(server.port(), "POST", "/v1/jobs/" + id + "/cancel");
  auto event = client.event();
  while (event && event->name == "progress") event = client.event();
  REQUIRE(event);
  CHECK(event->name == "canceled");
  CHECK(json::parse(event->data).at("state") == "canceled");
  CHECK(client.is_closed_by_server());
}

TEST_CASE("the first event comes at once, however long the interval") {
  const TestServer server;
  const std::string id = server.submit(endless_job(R"(, "progress_interval_s": 3600)"));
  Client client(server.port());
  open_events(client, id);
  CHECK(client.event()->name == "progress");
  call(server.port(), "DELETE", "/v1/jobs/" + id);
  CHECK(client.event()->name == "canceled");
}

TEST_CASE("a job that has ended has its final event only, and to those who know it nothing") {
  const TestServer server;
  const std::string id = server.submit(small_job());
  REQUIRE(server.reaches(id, "succeeded"));
  Client client(server.port());
  open_events(client, id);
  const auto event = client.event();
  REQUIRE(event);
  CHECK(event->name == "succeeded");
  CHECK(json::parse(event->data).at("percent") == 100);
  CHECK(client.is_closed_by_server());

  const std::string seen = "Last-Event-ID: " + event->id + "\r\n";
  CHECK(call(server.port(), "GET", "/v1/jobs/" + id + "/events", "", seen).status == 204);
  Client again(server.port());
  open_events(again, id, "Last-Event-ID: 17\r\n");
  CHECK(again.event()->name == "succeeded");
  Client strange(server.port());
  open_events(strange, id, "Last-Event-ID: nonsense\r\n");
  CHECK(strange.event()->name == "succeeded");
}

TEST_CASE("who comes back is told only what is newer") {
  const TestServer server;
  const std::string id = server.submit(steady_job("0.05"));
  long last_id = 0;
  for (int i = 0; i < 3; ++i) {
    Client client(server.port());
    open_events(client, id, i == 0 ? "" : "Last-Event-ID: " + std::to_string(last_id) + "\r\n");
    const auto event = client.event();
    REQUIRE(event);
    CHECK(std::stol(event->id) > last_id);
    last_id = std::stol(event->id);
  }
}

TEST_CASE("streams are limited, and closed ones make room") {
  penumbra::http::ServerSettings settings;
  settings.streams.all = 2;
  const TestServer server({}, settings);
  const std::string id = server.submit(endless_job());
  Client first(server.port()), second(server.port());
  open_events(first, id);
  open_events(second, id);
  // Any other answer than this one would keep an EventSource from coming back.
  Client refused(server.port());
  open_events(refused, id);
  CHECK_FALSE(refused.event());
  first.close();
  CHECK(eventually([&] {
    Client third(server.port());
    third.send("GET /v1/jobs/" + id + "/events HTTP/1.1\r\nHost: a\r\n\r\n");
    return third.head() && third.event().has_value();
  }));
}

TEST_CASE("HEAD of a stream does not hold one") {
  penumbra::http::ServerSettings settings;
  settings.streams.all = 1;
  const TestServer server({}, settings);
  const std::string id = server.submit(endless_job());
  for (int i = 0; i < 3; ++i) CHECK(call(server.port(), "HEAD", "/v1/jobs/" + id + "/events").status == 200);
  Client client(server.port());
  open_events(client, id);
}
