#include <doctest/doctest.h>

#include <memory>

#include "server/store/memory_store.h"
#include "server/store/sha256.h"

// What every store must do. Another store is one more type after MemoryStore in each case.

using namespace penumbra::store;
using Outcome = Created::Outcome;
using std::chrono::hours;
using std::chrono::seconds;

namespace {

const Time noon = Time(hours(500'000));

JobRecord job_of(const std::string& id, Time created_at = noon) {
  JobRecord job;
  job.id = id;
  job.priority = 7;
  job.progress_interval_s = 0.25;
  job.created_at = created_at;
  return job;
}

Image image_of(const std::string& bytes) {
  return {std::make_shared<const std::string>(bytes), "image/png", sha256_hex(bytes), nullptr};
}

Ending success(const std::string& bytes, Time finished_at = noon + seconds(2)) {
  Ending ending;
  ending.finished_at = finished_at;
  ending.stats = penumbra::render::Stats{};
  ending.stats->render_s = 1.5;
  ending.image = image_of(bytes);
  return ending;
}

Ending end_in(JobState state) {
  Ending ending;
  ending.state = state;
  ending.percent = 40;
  ending.finished_at = noon + seconds(1);
  if (state == JobState::failed) ending.error = penumbra::api::Problem{"/problems/x", "X", 500, "it broke", {}};
  return ending;
}

std::vector<std::string> ids_of(const std::vector<JobRecord>& jobs) {
  std::vector<std::string> ids;
  for (const JobRecord& job : jobs) ids.push_back(job.id);
  return ids;
}

void finish(JobStore& store, const std::string& id, const Ending& ending) {
  store.start(id, noon);
  REQUIRE(store.finish(id, ending));
}

}  // namespace

TEST_CASE_TEMPLATE("a job is found as it was stored, with its body", Store, MemoryStore) {
  Store store;
  CHECK_FALSE(store.find("a"));
  CHECK(store.create(job_of("a"), "the body", {}).outcome == Outcome::created);
  const auto job = store.find("a");
  REQUIRE(job);
  CHECK(job->state == JobState::queued);
  CHECK(job->priority == 7);
  CHECK(job->progress_interval_s == 0.25);
  CHECK(job->created_at == noon);
  CHECK_FALSE(job->started_at);
  CHECK(store.spec("a") == "the body");
  CHECK_FALSE(store.spec("b"));
  REQUIRE(store.image("a"));
  CHECK(store.image("a")->state == ImageState::none);
  CHECK_FALSE(store.image("b"));
}

TEST_CASE_TEMPLATE("a job goes from queued to running to its end, and no way back", Store, MemoryStore) {
  Store store;
  store.create(job_of("a"), "body", {});
  CHECK(store.start("a", noon + seconds(1)));
  CHECK_FALSE(store.start("a", noon + seconds(1)));
  CHECK(store.find("a")->state == JobState::running);
  CHECK(store.find("a")->started_at == noon + seconds(1));

  CHECK(store.finish("a", success("bytes")));
  CHECK_FALSE(store.finish("a", end_in(JobState::failed)));
  CHECK_FALSE(store.start("a", noon));
  const auto job = store.find("a");
  CHECK(job->state == JobState::succeeded);
  CHECK(job->percent == 100);
  CHECK(job->finished_at == noon + seconds(2));
  CHECK(job->stats->render_s == 1.5);
  CHECK_FALSE(store.spec("a"));
  const auto found = store.image("a");
  REQUIRE(found->state == ImageState::present);
  CHECK(*found->image.bytes == "bytes");
  CHECK(found->image.media_type == "image/png");
  CHECK(found->image.sha256 == sha256_hex("bytes"));
}

TEST_CASE_TEMPLATE("jobs that fail or are canceled keep why and where, and have no image", Store, MemoryStore) {
  Store store;
  store.create(job_of("a"), "body", {});
  store.create(job_of("b"), "body", {});
  CHECK(store.finish("a", end_in(JobState::canceled)));  // while queued
  finish(store, "b", end_in(JobState::failed));
  CHECK(store.find("a")->state == JobState::canceled);
  CHECK(store.find("b")->percent == 40);
  CHECK(store.find("b")->error->detail == "it broke");
  CHECK(store.image("b")->state == ImageState::none);
  CHECK_FALSE(store.finish("c", end_in(JobState::failed)));
}

TEST_CASE_TEMPLATE("an idempotency key makes one job of equal bodies and refuses others", Store, MemoryStore) {
  Store store;
  const IdempotencyKey key{"key", "hash", ""};
  CHECK_FALSE(store.find_key(key));
  CHECK(store.create(job_of("a"), "body", key).outcome == Outcome::created);
  const Created again = store.create(job_of("b"), "body", key);
  CHECK(again.outcome == Outcome::repeated);
  CHECK(again.job.id == "a");
  CHECK_FALSE(store.find("b"));
  CHECK(store.find_key(key)->job.id == "a");
  CHECK(store.create(job_of("b"), "other", IdempotencyKey{"key", "other hash", ""}).outcome == Outcome::conflict);
  CHECK(store.create(job_of("c"), "other", IdempotencyKey{"other key", "hash", ""}).outcome == Outcome::created);

  finish(store, "a", success("bytes"));
  CHECK(store.create(job_of("d"), "body", key).job.id == "a");
  CHECK(store.remove("a"));
  CHECK(store.create(job_of("e"), "body", key).outcome == Outcome::created);
}

TEST_CASE_TEMPLATE("the key of a canceled job is free again", Store, MemoryStore) {
  Store store;
  const IdempotencyKey key{"key", "hash", ""}, other_body{"key", "other hash", ""};
  store.create(job_of("a"), "body", key);
  store.finish("a", end_in(JobState::canceled));
  CHECK(store.create(job_of("b"), "other", other_body).outcome == Outcome::created);
  CHECK(store.remove("a"));
  CHECK(store.find_key(other_body)->job.id == "b");
}

TEST_CASE_TEMPLATE("a removed job is gone with everything", Store, MemoryStore) {
  Store store;
  store.create(job_of("a"), "body", {});
  finish(store, "a", success("bytes"));
  CHECK(store.remove("a"));
  CHECK_FALSE(store.remove("a"));
  CHECK_FALSE(store.find("a"));
  CHECK_FALSE(store.image("a"));
  CHECK_FALSE(store.finish("a", success("bytes")));
}

TEST_CASE_TEMPLATE("lists are newest first, by state, page after page", Store, MemoryStore) {
  Store store;
  for (const char* id : {"a", "b", "c", "d", "e"}) store.create(job_of(id), "body", {});
  finish(store, "b", success("bytes"));
  finish(store, "d", success("bytes"));

  const Page all = store.list({}, 10, {});
  CHECK(ids_of(all.jobs) == std::vector<std::string>{"e", "d", "c", "b", "a"});
  CHECK_FALSE(all.next_page_token);
  CHECK(ids_of(store.list({JobState::succeeded, {}}, 10, {}).jobs) == std::vector<std::string>{"d", "b"});

  const Page first = store.list({}, 2, {});
  CHECK(ids_of(first.jobs) == std::vector<std::string>{"e", "d"});
  REQUIRE(first.next_page_token);
  store.create(job_of("f"), "body", {});  // newer: does not shift the pages
  const Page second = store.list({}, 2, first.next_page_token);
  CHECK(ids_of(second.jobs) == std::vector<std::string>{"c", "b"});
  const Page last = store.list({}, 2, second.next_page_token);
  CHECK(ids_of(last.jobs) == std::vector<std::string>{"a"});
  CHECK_FALSE(last.next_page_token);

  // Exactly full is the last page too.
  CHECK_FALSE(store.list({JobState::succeeded, {}}, 2, {}).next_page_token);
}

TEST_CASE_TEMPLATE("what is unfinished is known, oldest first", Store, MemoryStore) {
  Store store;
  for (const char* id : {"a", "b", "c"}) store.create(job_of(id), "body", {});
  store.start("b", noon);
  finish(store, "a", end_in(JobState::failed));
  CHECK(ids_of(store.unfinished()) == std::vector<std::string>{"b", "c"});
}

TEST_CASE_TEMPLATE("images and jobs expire by age and by number, oldest first", Store, MemoryStore) {
  Store store;
  for (const char* id : {"a", "b", "c"}) {
    store.create(job_of(id), "body", {});
    finish(store, id, success(std::string(100, *id)));
  }
  store.create(job_of("d"), "body", {});
  Retention retention;

  store.expire(retention, noon + hours(1));
  CHECK(store.image("a")->state == ImageState::present);

  retention.max_image_bytes = 250;
  store.expire(retention, noon + hours(1));
  CHECK(store.image("a")->state == ImageState::expired);
  CHECK(store.image("b")->state == ImageState::present);
  CHECK(store.find("a")->state == JobState::succeeded);

  retention.max_jobs = 1;
  store.expire(retention, noon + hours(1));
  CHECK_FALSE(store.find("a"));
  CHECK_FALSE(store.find("b"));
  CHECK(store.find("c"));

  store.expire(retention, noon + hours(25));
  CHECK(store.image("c")->state == ImageState::expired);
  store.expire(retention, noon + hours(8 * 24));
  CHECK_FALSE(store.find("c"));
  CHECK(store.find("d"));  // unfinished jobs stay
}

TEST_CASE("SHA-256 of the standard's example") {
  CHECK(sha256_hex("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}
