#include <doctest/doctest.h>

#include "api/job_request.h"
#include "api/job_resource.h"
#include "api/json_reader.h"
#include "engine/math/constants.h"
#include "tests/api/corpus.h"

using namespace penumbra;

namespace {

api::Time at(long long milliseconds) { return api::Time(std::chrono::milliseconds(milliseconds)); }

api::JobResource queued_job() {
  api::JobResource job;
  job.id = "abc";
  job.queue_position = 3;
  job.created_at = at(1'795'514'400'123);
  return job;
}

}  // namespace

TEST_CASE("times are RFC 3339 in UTC with milliseconds") {
  CHECK(api::rfc3339(at(0)) == "1970-01-01T00:00:00.000Z");
  CHECK(api::rfc3339(at(1'795'514'400'123)) == "2026-11-24T10:00:00.123Z");
  CHECK(api::rfc3339(at(1'709'251'199'999)) == "2024-02-29T23:59:59.999Z");
  CHECK(api::rfc3339(at(-1)) == "1969-12-31T23:59:59.999Z");
}

TEST_CASE("states have names and back") {
  for (const char* name : {"queued", "running", "succeeded", "failed", "canceled"}) {
    CHECK(api::name_of(api::job_state_of(name).value()) == name);
  }
  CHECK_FALSE(api::job_state_of("done"));
  CHECK_FALSE(api::job_state_of(""));
}

TEST_CASE("a queued job has every key, in the contract's order") {
  CHECK(api::to_json(queued_job()) ==
        R"({"id":"abc","state":"queued","progress":{"percent":0.0,"eta_s":null},"queue_position":3,)"
        R"("created_at":"2026-11-24T10:00:00.123Z","started_at":null,"finished_at":null,"error":null,"stats":null,)"
        R"("name":"","width":null,"height":null,"format":null,"size_bytes":null,)"
        R"("links":{"self":"/v1/jobs/abc","events":"/v1/jobs/abc/events","image":"/v1/jobs/abc/image",)"
        R"("preview":"/v1/jobs/abc/preview","thumbnail":"/v1/jobs/abc/thumbnail","scene":"/v1/jobs/abc/scene",)"
        R"("cancel":"/v1/jobs/abc/cancel"}})");
}

TEST_CASE("a finished job carries its statistics") {
  api::JobResource job = queued_job();
  job.state = api::JobState::succeeded;
  job.percent = 99;
  job.queue_position.reset();
  job.started_at = at(1'795'514'401'000);
  job.finished_at = at(1'795'514'402'000);
  render::Stats stats;
  stats.build_s = 0.5;
  stats.rays = {1, 2, 3, 18446744073709551615u};
  stats.skipped = {{"samples", 7}};
  job.stats = stats;
  const std::string text = api::to_json(job);
  CHECK(text.find(R"("progress":{"percent":100.0,)") != std::string::npos);
  CHECK(text.find(R"("finished_at":"2026-11-24T10:00:02.000Z")") != std::string::npos);
  CHECK(
      text.find(R"("stats":{"build_s":0.5,"render_s":0.0,"encode_s":0.0,"rays":{"camera":1,"shadow":2,"reflection":3,)"
                R"("transmission":18446744073709551615},"skipped":{"samples":7},"estimated_error":0.0})") !=
      std::string::npos);
  CHECK(text.find(api::to_json(stats)) != std::string::npos);
}

TEST_CASE("a job tells what its image is like") {
  api::JobResource job = queued_job();
  job.name = "a ball";
  job.shape = api::ImageShape{640, 480, scene::ImageFormat::exr};
  job.size_bytes = 1234;
  CHECK(api::to_json(job).find(R"("name":"a ball","width":640,"height":480,"format":"exr","size_bytes":1234,)") !=
        std::string::npos);
}

TEST_CASE("a failed job carries its problem") {
  api::JobResource job = queued_job();
  job.state = api::JobState::failed;
  job.error = api::Problem{"/problems/x", "X", 500, "why", {}};
  CHECK(api::to_json(job).find(R"("error":{"type":"/problems/x","title":"X","status":500,"detail":"why"},)") !=
        std::string::npos);
}

TEST_CASE("no percentage but a succeeded one shows 100") {
  api::JobResource job = queued_job();
  job.state = api::JobState::running;
  job.eta_s = 1.23456;
  for (const double percent : {99.999, 100.0, 250.0}) {
    job.percent = percent;
    CHECK(api::progress_json(job) == R"({"percent":99.99,"eta_s":1.234,"state":"running"})");
  }
  job.percent = 42.5;
  CHECK(api::progress_json(job) == R"({"percent":42.5,"eta_s":1.234,"state":"running"})");
  job.percent = math::nan;
  CHECK(api::progress_json(job).find(R"("percent":0)") != std::string::npos);
}

TEST_CASE("a page of jobs") {
  CHECK(api::to_json(std::vector<api::JobResource>{}, std::nullopt) == R"({"jobs":[],"next_page_token":null})");
  const std::string two = api::to_json(std::vector{queued_job(), queued_job()}, "next");
  CHECK(two == R"({"jobs":[)" + api::to_json(queued_job()) + "," + api::to_json(queued_job()) +
                   R"(],"next_page_token":"next"})");
}

TEST_CASE("the cost estimate as an answer") {
  api::CostEstimate cost;
  cost.primitives = 1;
  cost.pixels = 100;
  cost.work = 1e12;
  CHECK(
      api::to_json(cost) ==
      R"({"valid":true,"cost":{"primitives":1,"triangles":0,"lights":0,"pixels":100,"work":1000000000000.0,"memory_bytes":0}})");
}

TEST_CASE("a problem document survives any text") {
  const api::Problem problem{"about:blank", "T", 422, "bad \xff \n \"", {{"/a~1b", "d\x01"}}};
  const std::string text = api::to_json(problem);
  const api::JsonDocument read = api::read_json(text);
  CHECK(tests::text_of(read.root()).find("/a~1b") != std::string::npos);
  CHECK(text.find('\n') == std::string::npos);
}
