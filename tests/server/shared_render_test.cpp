#include <doctest/doctest.h>

#include "tests/server/fixture.h"

using nlohmann::json;

namespace {

penumbra::jobs::Settings settings_for(int at_once) {
  penumbra::jobs::Settings settings;
  settings.jobs = at_once;
  return settings;
}

double renders(const TestServer& server) {
  const std::string text = call(server.port(), "GET", "/metrics").body;
  const std::string name = "\npenumbra_renders ";
  return std::stod(text.substr(text.find(name) + name.size()));
}

std::string with_priority(int priority) { return R"(, "priority": )" + std::to_string(priority); }

}  // namespace

TEST_CASE("an image that is known is not rendered again") {
  const TestServer server;
  const std::string slow = small_job(R"("width": 400, "height": 400, "samples_per_pixel": 64)");
  const Reply first = post(server.port(), "/v1/render", slow);
  REQUIRE(first.status == 200);
  const std::string other_words =
      small_job(R"("samples_per_pixel": 6.4e1, "height": 400, "width": 400, "threads": 1, "priority": 9,
                   "progress_interval_s": 3)");
  const Reply again = post(server.port(), "/v1/jobs", other_words);
  CHECK(again.status == 202);
  const json job = json::parse(again.body);
  CHECK(job.at("state") == "succeeded");
  CHECK(job.at("progress").at("percent") == 100);
  CHECK(job.at("id") != first.headers.at("x-job-id"));
  const std::string id = job.at("id");
  CHECK(call(server.port(), "GET", "/v1/jobs/" + id + "/image").body == first.body);
  CHECK(job.at("stats") == server.job(first.headers.at("x-job-id")).at("stats"));
  CHECK(post(server.port(), "/v1/render", slow).headers.at("etag") == first.headers.at("etag"));
}

TEST_CASE("what decides about the image, or about nothing for sure, is rendered") {
  const TestServer server;
  post(server.port(), "/v1/render", small_job());
  for (const char* options :
       {R"("width": 16, "height": 16, "seed": 1)", R"("width": 16, "height": 16, "bit_depth": 16)",
        R"("width": 16, "height": 16, "acceleration": "none")"}) {
    const json job = json::parse(post(server.port(), "/v1/jobs", small_job(options)).body);
    CHECK(job.at("state") == "queued");
  }
  const std::string budget = small_job(R"("width": 16, "height": 16, "time_budget_s": 0.01)");
  post(server.port(), "/v1/render", budget);
  CHECK(json::parse(post(server.port(), "/v1/jobs", budget).body).at("state") == "queued");
}

TEST_CASE("equal jobs render once, and each may be canceled without harm to the other") {
  const TestServer server(settings_for(4));
  const std::string first = server.submit(endless_job());
  REQUIRE(server.reaches(first, "running"));
  const std::string second = server.submit(endless_job()), third = server.submit(endless_job(with_priority(5)));
  REQUIRE(server.reaches(second, "running"));
  REQUIRE(server.reaches(third, "running"));
  CHECK(renders(server) == 1);
  CHECK(eventually([&] { return server.job(second).at("progress").at("percent") > 0; }));

  call(server.port(), "POST", "/v1/jobs/" + first + "/cancel");
  CHECK(server.state_of(first) == "canceled");
  call(server.port(), "DELETE", "/v1/jobs/" + third);
  CHECK(call(server.port(), "GET", "/v1/jobs/" + third).status == 404);
  CHECK(server.state_of(second) == "running");
  CHECK(renders(server) == 1);

  call(server.port(), "POST", "/v1/jobs/" + second + "/cancel");
  CHECK(server.reaches(second, "canceled"));
  // The render that was on its way out is nobody's to join.
  const std::string fourth = server.submit(endless_job());
  CHECK(server.reaches(fourth, "running"));
}

TEST_CASE("a render that waits has the priority of its most urgent job, as long as that wants it") {
  const TestServer server(settings_for(1));
  const std::string running = server.submit(endless_job());
  REQUIRE(server.reaches(running, "running"));
  const std::string low = server.submit(small_job()), middle = server.submit(another_job());
  CHECK(server.job(low).at("queue_position") == 1);
  const std::string urgent = server.submit(small_job(R"("width": 17, "height": 17, "priority": 1)"));
  CHECK(server.job(low).at("queue_position") == 2);
  const std::string most_urgent = server.submit(small_job(R"("width": 16, "height": 16, "priority": 2)"));
  CHECK(server.job(low).at("queue_position") == 1);
  CHECK(server.job(most_urgent).at("queue_position") == 1);
  CHECK(server.job(urgent).at("queue_position") == 2);
  call(server.port(), "POST", "/v1/jobs/" + most_urgent + "/cancel");
  CHECK(server.state_of(most_urgent) == "canceled");
  CHECK(server.job(urgent).at("queue_position") == 1);
  CHECK(server.job(low).at("queue_position") == 2);
  CHECK(server.job(middle).at("queue_position") == 3);
  const std::string again = server.submit(small_job());
  call(server.port(), "POST", "/v1/jobs/" + running + "/cancel");
  for (const std::string& id : {low, middle, urgent, again}) CHECK(server.reaches(id, "succeeded"));
  CHECK(call(server.port(), "GET", "/v1/jobs/" + low + "/image").body ==
        call(server.port(), "GET", "/v1/jobs/" + again + "/image").body);
}

TEST_CASE("clients that wait for the same image all get it; one that leaves takes nobody with it") {
  const TestServer server(settings_for(1));
  const std::string running = server.submit(endless_job());
  REQUIRE(server.reaches(running, "running"));
  const std::string body = small_job();
  const std::string call_text =
      "POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\nContent-Length: " +
      std::to_string(body.size()) + "\r\n\r\n" + body;
  Client first(server.port()), second(server.port()), third(server.port());
  for (Client* client : {&first, &second, &third}) client->send(call_text);
  const auto queued = [&] {
    return json::parse(call(server.port(), "GET", "/v1/jobs?state=queued").body).at("jobs").size();
  };
  REQUIRE(eventually([&] { return queued() == 3; }));
  first.close();
  REQUIRE(eventually([&] { return queued() == 2; }));
  call(server.port(), "POST", "/v1/jobs/" + running + "/cancel");
  const auto a = second.reply(), b = third.reply();
  REQUIRE(a);
  REQUIRE(b);
  CHECK(a->status == 200);
  CHECK(a->body == b->body);
}
