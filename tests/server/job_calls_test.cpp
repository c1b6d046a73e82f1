#include <doctest/doctest.h>

#include <set>

#include "tests/server/fixture.h"

using nlohmann::json;

namespace {

penumbra::jobs::Settings one_at_a_time() {
  penumbra::jobs::Settings settings;
  settings.jobs = 1;
  return settings;
}

json parsed(const Reply& reply) { return json::parse(reply.body); }

void check_problem(const Reply& reply, int status, const std::string& type) {
  CHECK(reply.status == status);
  CHECK(reply.headers.at("content-type") == "application/problem+json");
  CHECK(parsed(reply).at("status") == status);
  CHECK(parsed(reply).at("type") == "/problems/" + type);
}

}  // namespace

TEST_CASE("a job is accepted, rendered and fetched") {
  const TestServer server;
  const Reply accepted = post(server.port(), "/v1/jobs", small_job());
  CHECK(accepted.status == 202);
  const json job = parsed(accepted);
  const std::string id = job.at("id");
  CHECK(accepted.headers.at("location") == "/v1/jobs/" + id);
  CHECK(job.at("progress").at("percent") == 0);
  CHECK(job.at("links").at("image") == "/v1/jobs/" + id + "/image");

  REQUIRE(server.reaches(id, "succeeded"));
  const json done = server.job(id);
  CHECK(done.at("progress").at("percent") == 100);
  CHECK(done.at("queue_position").is_null());
  CHECK(done.at("error").is_null());
  CHECK(done.at("started_at") >= done.at("created_at"));
  CHECK(done.at("finished_at") >= done.at("started_at"));
  CHECK(done.at("stats").at("rays").at("camera") == 256);
  CHECK(done.at("stats").at("encode_s") > 0);

  const Reply image = call(server.port(), "GET", "/v1/jobs/" + id + "/image");
  CHECK(image.status == 200);
  CHECK(image.headers.at("content-type") == "image/png");
  CHECK(image.body.starts_with("\x89PNG"));
  const std::string tag = image.headers.at("etag");
  CHECK(tag.starts_with('"'));

  for (const std::string& match : {tag, "\"other\", W/" + tag, std::string("*")}) {
    const Reply again = call(server.port(), "GET", "/v1/jobs/" + id + "/image", "", "If-None-Match: " + match + "\r\n");
    CHECK(again.status == 304);
    CHECK(again.headers.at("etag") == tag);
    CHECK(again.body.empty());
  }
  CHECK(call(server.port(), "GET", "/v1/jobs/" + id + "/image", "", "If-None-Match: \"x\"\r\n").status == 200);
  CHECK(call(server.port(), "GET", "/v1/jobs/" + id + "/preview").body == image.body);
  CHECK(call(server.port(), "GET", "/v1/jobs/" + id + "/image", "", "Range: bytes=0-1\r\n").body == image.body);
}

TEST_CASE("the same job gives the same tag, another seed of noise another") {
  const TestServer server;
  const auto tag = [&](const std::string& job) { return post(server.port(), "/v1/render", job).headers.at("etag"); };
  CHECK(tag(small_job()) == tag(small_job()));
  CHECK(tag(small_job()) != tag(small_job(R"("width": 17, "height": 16)")));
}

TEST_CASE("validate_only checks and queues nothing") {
  const TestServer server;
  const Reply valid = post(server.port(), "/v1/jobs?validate_only=true", small_job());
  CHECK(valid.status == 200);
  CHECK(parsed(valid).at("cost").at("pixels") == 256);
  CHECK(parsed(call(server.port(), "GET", "/v1/jobs")).at("jobs").empty());
  check_problem(post(server.port(), "/v1/jobs?validate_only=true", "{}"), 422, "invalid-scene");
  check_problem(post(server.port(), "/v1/jobs?validate_only=perhaps", small_job()), 400, "bad-parameter");
}

TEST_CASE("bad bodies are told everything at once") {
  const TestServer server;
  for (const char* path : {"/v1/jobs", "/v1/render"}) {
    const Reply reply = post(server.port(), path, R"({"scene": {"camera": 1, "x": 2}, "options": {"width": 0}})");
    check_problem(reply, 422, "invalid-scene");
    std::set<std::string> pointers;
    const json problem = parsed(reply);
    for (const json& error : problem.at("errors")) pointers.insert(error.at("pointer"));
    CHECK(json(pointers).dump() == R"(["/options/width","/scene/camera","/scene/x"])");
    check_problem(post(server.port(), path, "not JSON"), 400, "not-json");
    check_problem(post(server.port(), path, ""), 400, "not-json");
    CHECK(post(server.port(), path, std::string(100'000, '[')).status == 422);
  }
}

TEST_CASE("no such job, no such path, no such method") {
  const TestServer server;
  const std::string job = "/v1/jobs/01JDF3Z4N6Q8R0S2T4V6X8Y0Z2";
  for (const char* call_of_job : {"", "/events", "/image", "/preview", "/thumbnail", "/scene"})
    check_problem(call(server.port(), "GET", job + call_of_job), 404, "not-found");
  check_problem(call(server.port(), "POST", job + "/cancel"), 404, "not-found");
  check_problem(call(server.port(), "DELETE", job), 404, "not-found");
  for (const char* path :
       {"/nothing", "/v1/jobs/", "/v1/jobs/a/b", "/v1/jobs/%0A", "/v1/jobs/../jobs", "//", "/v1//jobs"})
    check_problem(call(server.port(), "GET", path), 404, "not-found");

  const Reply put = call(server.port(), "PUT", "/v1/jobs", "{}");
  check_problem(put, 405, "method-not-allowed");
  CHECK(put.headers.at("allow") == "POST, GET, HEAD, OPTIONS");
  check_problem(call(server.port(), "GET", "/v1/render"), 405, "method-not-allowed");
  check_problem(call(server.port(), "DELETE", "/healthz"), 405, "method-not-allowed");

  const Reply options = call(server.port(), "OPTIONS", "/v1/jobs/a/cancel");
  CHECK(options.status == 204);
  CHECK(options.headers.at("allow") == "POST, OPTIONS");
  const Reply head = call(server.port(), "HEAD", "/v1/jobs");
  CHECK(head.status == 200);
  CHECK(head.body.empty());
  CHECK(std::stoi(head.headers.at("content-length")) > 0);
}

TEST_CASE("lists are paged, newest first, and filtered by state") {
  const TestServer server(one_at_a_time());
  std::vector<std::string> ids;
  for (int i = 0; i < 5; ++i) ids.push_back(server.submit(another_job()));
  for (const std::string& id : ids) REQUIRE(server.reaches(id, "succeeded"));
  const std::string running = server.submit(endless_job());
  REQUIRE(server.reaches(running, "running"));
  const std::string queued = server.submit(another_job());

  std::vector<std::string> seen;
  std::string token;
  int pages = 0;
  do {
    const Reply reply = call(server.port(), "GET", "/v1/jobs?limit=3" + (token.empty() ? "" : "&page_token=" + token));
    REQUIRE(reply.status == 200);
    const json page = parsed(reply);
    for (const json& job : page.at("jobs")) seen.push_back(job.at("id"));
    const json next = page.at("next_page_token");
    token = next.is_null() ? "" : next.get<std::string>();
    ++pages;
  } while (!token.empty());
  CHECK(pages == 3);
  std::vector<std::string> expected(ids.rbegin(), ids.rend());
  expected.insert(expected.begin(), {queued, running});
  CHECK(json(seen).dump() == json(expected).dump());

  const json waiting = parsed(call(server.port(), "GET", "/v1/jobs?state=queued")).at("jobs");
  REQUIRE(waiting.size() == 1);
  CHECK(waiting[0].at("id") == queued);
  CHECK(waiting[0].at("queue_position") == 1);
  CHECK(parsed(call(server.port(), "GET", "/v1/jobs?state=succeeded")).at("jobs").size() == 5);
  for (const char* bad : {"state=done", "limit=0", "limit=1001", "limit=x", "limit=", "page_token=x", "limit=-1"})
    check_problem(call(server.port(), "GET", std::string("/v1/jobs?") + bad), 400, "bad-parameter");
}

TEST_CASE("canceling: while queued, while running, twice, and too late") {
  const TestServer server(one_at_a_time());
  const std::string running = server.submit(endless_job());
  REQUIRE(server.reaches(running, "running"));
  const std::string queued = server.submit(endless_job(fresh_seed()));
  const std::string next = server.submit(small_job());
  CHECK(server.job(next).at("queue_position") == 2);
  check_problem(call(server.port(), "GET", "/v1/jobs/" + queued + "/preview"), 409, "no-image");
  check_problem(call(server.port(), "GET", "/v1/jobs/" + running + "/image"), 409, "no-image");

  const Reply canceled = call(server.port(), "POST", "/v1/jobs/" + queued + "/cancel");
  CHECK(canceled.status == 200);
  CHECK(parsed(canceled).at("state") == "canceled");
  CHECK(parsed(canceled).at("progress").at("percent") == 0);
  CHECK(server.job(next).at("queue_position") == 1);

  // The cores are free soon: the job behind gets them.
  CHECK(call(server.port(), "POST", "/v1/jobs/" + running + "/cancel").status == 200);
  CHECK(server.reaches(running, "canceled"));
  CHECK(server.reaches(next, "succeeded"));
  CHECK(call(server.port(), "POST", "/v1/jobs/" + running + "/cancel").status == 200);
  check_problem(call(server.port(), "POST", "/v1/jobs/" + next + "/cancel"), 409, "job-ended");
  check_problem(call(server.port(), "GET", "/v1/jobs/" + running + "/image"), 409, "no-image");
  check_problem(call(server.port(), "GET", "/v1/jobs/" + running + "/preview"), 409, "no-image");
}

TEST_CASE("cancel needs no body and no length") {
  const TestServer server;
  const std::string id = server.submit(endless_job());
  Client client(server.port());
  client.send("POST /v1/jobs/" + id + "/cancel HTTP/1.1\r\nHost: a\r\n\r\n");
  CHECK(client.reply()->status == 200);
  CHECK(client.is_closed_by_server());
  CHECK(server.reaches(id, "canceled"));
}

TEST_CASE("a deleted job is gone, and was canceled before") {
  const TestServer server(one_at_a_time());
  const std::string running = server.submit(endless_job());
  REQUIRE(server.reaches(running, "running"));
  const std::string queued = server.submit(endless_job(fresh_seed())), last = server.submit(small_job());
  for (const std::string& id : {queued, running}) {
    const Reply reply = call(server.port(), "DELETE", "/v1/jobs/" + id);
    CHECK(reply.status == 204);
    CHECK(reply.body.empty());
    CHECK(call(server.port(), "GET", "/v1/jobs/" + id).status == 404);
    CHECK(call(server.port(), "DELETE", "/v1/jobs/" + id).status == 404);
  }
  CHECK(server.reaches(last, "succeeded"));
  CHECK(call(server.port(), "DELETE", "/v1/jobs/" + last).status == 204);
  CHECK(parsed(call(server.port(), "GET", "/v1/jobs")).at("jobs").empty());
}

TEST_CASE("a repeated Idempotency-Key makes no second job") {
  const TestServer server;
  const std::string key = "Idempotency-Key: key-1\r\n";
  const Reply first = post(server.port(), "/v1/jobs", small_job(), key);
  const Reply again = post(server.port(), "/v1/jobs", small_job(), key);
  CHECK(again.status == 202);
  CHECK(parsed(again).at("id") == parsed(first).at("id"));
  CHECK(again.headers.at("location") == first.headers.at("location"));
  check_problem(post(server.port(), "/v1/jobs", small_job(R"("width": 9)"), key), 409, "idempotency-conflict");
  CHECK(post(server.port(), "/v1/render", small_job(), key).headers.at("x-job-id") == parsed(first).at("id"));
  CHECK(parsed(call(server.port(), "GET", "/v1/jobs")).at("jobs").size() == 1);
  // No key but itself is the same key.
  for (const char* other : {"key%2D1", "key%2d1", "key-1%", "key-1%25", "%6bey-1"}) {
    CAPTURE(other);
    CHECK(post(server.port(), "/v1/jobs", small_job(R"("width": 9)"), "Idempotency-Key: " + std::string(other) + "\r\n")
              .status == 202);
  }
  check_problem(post(server.port(), "/v1/jobs", small_job(), "Idempotency-Key: " + std::string(256, 'k') + "\r\n"), 400,
                "bad-parameter");
}

TEST_CASE("an image that has expired is gone for good") {
  penumbra::jobs::Settings settings = one_at_a_time();
  settings.retention.max_image_bytes = 1000;
  const TestServer server(settings);
  const std::string first = server.submit(small_job());
  REQUIRE(server.reaches(first, "succeeded"));
  REQUIRE(call(server.port(), "GET", "/v1/jobs/" + first + "/image").status == 200);
  for (const int width : {17, 18, 19, 20})
    post(server.port(), "/v1/render", small_job(R"("height": 16, "width": )" + std::to_string(width)));
  for (const char* what : {"/image", "/preview"})
    check_problem(call(server.port(), "GET", "/v1/jobs/" + first + what), 410, "image-expired");
  CHECK(server.state_of(first) == "succeeded");
}

TEST_CASE("a running job shows what it has") {
  const TestServer server;
  const std::string id = server.submit(endless_job());
  REQUIRE(server.reaches(id, "running"));
  const Reply preview = call(server.port(), "GET", "/v1/jobs/" + id + "/preview");
  CHECK(preview.status == 200);
  CHECK(preview.headers.at("content-type") == "image/png");
  CHECK(preview.body.starts_with("\x89PNG"));
  call(server.port(), "DELETE", "/v1/jobs/" + id);
}
