#include <doctest/doctest.h>

#include "tests/server/fixture.h"

using nlohmann::json;

namespace {

/// The only job that is running, once there is one.
std::string running_job(const TestServer& server) {
  std::string id;
  eventually([&] {
    const json jobs = json::parse(call(server.port(), "GET", "/v1/jobs?state=running").body).at("jobs");
    if (!jobs.empty()) id = jobs[0].at("id");
    return !id.empty();
  });
  return id;
}

/// Starts a render that will not end by itself; the reply has yet to come.
void start_endless(Client& client, const std::string& headers = "") {
  const std::string body = endless_job();
  client.send("POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\n" + headers +
              "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
}

}  // namespace

TEST_CASE("a render call waits and answers with the image, again and again on one connection") {
  const TestServer server;
  Client client(server.port());
  for (int i = 0; i < 10; ++i) {
    const auto reply = client.request("POST", "/v1/render", small_job(), "Content-Type: application/json\r\n");
    REQUIRE(reply);
    CHECK(reply->status == 200);
    CHECK(reply->headers.at("content-type") == "image/png");
    CHECK(reply->body.starts_with("\x89PNG"));
    const std::string id = reply->headers.at("x-job-id");
    CHECK(reply->headers.at("content-location") == "/v1/jobs/" + id + "/image");
    CHECK(server.state_of(id) == "succeeded");
  }
}

TEST_CASE("content types that are JSON") {
  const TestServer server;
  for (const char* type : {"application/json; charset=utf-8", "Application/JSON", "application/json;charset=\"UTF-8\""})
    CHECK(
        call(server.port(), "POST", "/v1/render", small_job(), "Content-Type: " + std::string(type) + "\r\n").status ==
        200);
}

TEST_CASE("a client that leaves cancels its render") {
  const TestServer server;
  Client client(server.port());
  start_endless(client);
  const std::string id = running_job(server);
  REQUIRE(!id.empty());
  client.close();
  CHECK(server.reaches(id, "canceled"));
}

TEST_CASE("a render canceled by someone else answers 409") {
  const TestServer server;
  Client client(server.port());
  start_endless(client);
  const std::string id = running_job(server);
  SUBCASE("by a cancel") { call(server.port(), "POST", "/v1/jobs/" + id + "/cancel"); }
  SUBCASE("by a delete") { call(server.port(), "DELETE", "/v1/jobs/" + id); }
  const auto reply = client.reply();
  REQUIRE(reply);
  CHECK(reply->status == 409);
  CHECK(json::parse(reply->body).at("type") == "/problems/job-canceled");
}

TEST_CASE("who only repeats a call does not cancel the job of the first") {
  const TestServer server;
  Client first(server.port());
  const std::string key = "Idempotency-Key: one\r\n";
  start_endless(first, key);
  const std::string id = running_job(server);
  {
    Client second(server.port());
    start_endless(second, key);
    CHECK(eventually([&] {
      const std::string text = call(server.port(), "GET", "/metrics").body;
      return text.find("penumbra_http_connections 3\n") != std::string::npos;
    }));
  }
  // Both others are closed: this call's own and that of the metrics.
  CHECK(eventually([&] {
    const std::string text = call(server.port(), "GET", "/metrics").body;
    return text.find("penumbra_http_connections 2\n") != std::string::npos;
  }));
  CHECK(server.state_of(id) == "running");
  first.close();
  CHECK(server.reaches(id, "canceled"));
  // Its key is free, so a client may try again.
  Client third(server.port());
  start_endless(third, key);
  CHECK(running_job(server) != id);
}
