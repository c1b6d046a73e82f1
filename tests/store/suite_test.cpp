#include <doctest/doctest.h>

#include "tests/store/records.h"
#include "tests/support/memory_store.h"

// What every store must do. Another store is one more type in each case.

using namespace penumbra::test;

TEST_CASE_TEMPLATE("a job is found as it was stored, with its body", Store, MemoryStore, FreshSqliteStore) {
  Store store;
  CHECK_FALSE(store.find("a"));
  CHECK(store.create(job_of("a"), "the body", {}).outcome == Outcome::created);
  const auto job = store.find("a");
  REQUIRE(job);
  CHECK(job->state == JobState::queued);
  CHECK(job->priority == 7);
  CHECK(job->progress_interval_s == 0.25);
  CHECK(job->created_at == noon);
  CHECK(job->name == "a ball");
  CHECK(job->shape->width == 640);
  CHECK(job->shape->height == 480);
  CHECK(job->shape->format == penumbra::scene::ImageFormat::exr);
  CHECK_FALSE(job->size_bytes);
  CHECK(job->is_awaited);
  CHECK_FALSE(job->started_at);
  CHECK(store.spec("a") == "the body");
  CHECK_FALSE(store.spec("b"));
  REQUIRE(store.image("a"));
  CHECK(store.image("a")->state == ImageState::none);
  CHECK_FALSE(store.image("b"));
}

TEST_CASE_TEMPLATE("a job goes from queued to running to its end, and no way back", Store, MemoryStore,
                   FreshSqliteStore) {
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
  CHECK(job->stats->rays.transmission == 4);
  CHECK(job->stats->skipped.at("shadows") == 5);
  CHECK(job->stats->estimated_error == 0.1);
  CHECK(job->size_bytes == 5);
  CHECK(store.spec("a") == "body");
  const auto found = store.image("a");
  REQUIRE(found->state == ImageState::present);
  CHECK(*found->image.bytes == "bytes");
  CHECK(found->image.media_type == "image/png");
  CHECK(found->image.sha256 == sha256_hex("bytes"));
}

TEST_CASE_TEMPLATE("jobs that fail or are canceled keep why and where, and have no image", Store, MemoryStore,
                   FreshSqliteStore) {
  Store store;
  store.create(job_of("a"), "body", {});
  store.create(job_of("b"), "body", {});
  CHECK(store.finish("a", end_in(JobState::canceled)));  // while queued
  finish(store, "b", end_in(JobState::failed));
  CHECK(store.find("a")->state == JobState::canceled);
  CHECK(store.find("b")->percent == 40);
  CHECK(store.find("b")->error->detail == "it broke");
  CHECK(store.find("b")->error->errors.at(0).pointer == "/a");
  CHECK(store.image("b")->state == ImageState::none);
  CHECK_FALSE(store.finish("c", end_in(JobState::failed)));
}

TEST_CASE_TEMPLATE("an idempotency key makes one job of equal bodies and refuses others", Store, MemoryStore,
                   FreshSqliteStore) {
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

TEST_CASE_TEMPLATE("the key of a canceled job is free again", Store, MemoryStore, FreshSqliteStore) {
  Store store;
  const IdempotencyKey key{"key", "hash", ""}, other_body{"key", "other hash", ""};
  store.create(job_of("a"), "body", key);
  store.finish("a", end_in(JobState::canceled));
  CHECK(store.create(job_of("b"), "other", other_body).outcome == Outcome::created);
  CHECK(store.remove("a"));
  CHECK(store.find_key(other_body)->job.id == "b");
}

TEST_CASE_TEMPLATE("a key can be freed while its job goes on", Store, MemoryStore, FreshSqliteStore) {
  Store store;
  const IdempotencyKey key{"key", "hash", ""};
  store.create(job_of("a"), "body", key);
  store.start("a", noon);
  store.free_key("a");
  CHECK_FALSE(store.find_key(key));
  CHECK(store.create(job_of("b"), "body", key).outcome == Outcome::created);
  store.free_key("a");  // has none any more
  store.remove("a");
  CHECK(store.find_key(key)->job.id == "b");
}

TEST_CASE_TEMPLATE("of jobs that are held nothing goes", Store, MemoryStore, FreshSqliteStore) {
  Store store;
  for (const char* id : {"a", "b", "c"}) {
    store.create(job_of(id), "body", {});
    finish(store, id, success(std::string(100, *id)));
  }
  Retention retention;
  retention.max_image_bytes = retention.max_spec_bytes = 0;
  retention.max_jobs = 1;
  std::string held = "a";
  retention.is_held = [&](const std::string& id) { return id == held; };
  store.expire(retention, noon + hours(24 * 365));
  CHECK(ids_of(store.list({}, 10, {}).jobs) == std::vector<std::string>{"a"});
  CHECK(*store.image("a")->image.bytes == std::string(100, 'a'));
  CHECK(store.spec("a"));
  held = "";
  store.expire(retention, noon);
  CHECK(store.find("a"));
  CHECK(store.image("a")->state == ImageState::expired);
  store.expire(retention, noon + hours(24 * 365));
  CHECK_FALSE(store.find("a"));
}

TEST_CASE_TEMPLATE("a removed job is gone with everything", Store, MemoryStore, FreshSqliteStore) {
  Store store;
  store.create(job_of("a"), "body", {});
  finish(store, "a", success("bytes"));
  CHECK(store.remove("a"));
  CHECK_FALSE(store.remove("a"));
  CHECK_FALSE(store.find("a"));
  CHECK_FALSE(store.image("a"));
  CHECK_FALSE(store.finish("a", success("bytes")));
  CHECK_FALSE(store.spec("a"));
}

TEST_CASE_TEMPLATE("bodies are kept with their jobs, as many bytes as there may be", Store, MemoryStore,
                   FreshSqliteStore) {
  Store store;
  for (const char* id : {"a", "b", "c"}) store.create(job_of(id), std::string(100, *id), {});
  Retention retention;
  retention.max_spec_bytes = 250;
  finish(store, "b", success("bytes", noon + seconds(1)));
  store.expire(retention, noon);
  CHECK_FALSE(store.spec("b"));
  CHECK(store.image("b")->state == ImageState::present);
  finish(store, "a", end_in(JobState::failed));
  store.expire(retention, noon);
  CHECK(store.spec("a") == std::string(100, 'a'));
  retention.max_spec_bytes = 0;
  store.expire(retention, noon);
  CHECK_FALSE(store.spec("a"));
  CHECK(store.spec("c") == std::string(100, 'c'));  // it is still needed
  store.remove("c");
  retention.max_spec_bytes = 100;
  store.create(job_of("d"), std::string(100, 'd'), {});
  finish(store, "d", success("bytes"));
  store.expire(retention, noon);
  CHECK(store.spec("d") == std::string(100, 'd'));
}

TEST_CASE_TEMPLATE("a thumbnail lives and counts with its image", Store, MemoryStore, FreshSqliteStore) {
  Store store;
  const std::string zeros = std::string("png\0\xff", 5);
  store.create(job_like("a", "hash"), "body", {});
  store.create(job_of("b"), "body", {});
  CHECK(store.thumbnail("a")->state == ImageState::none);
  CHECK_FALSE(store.thumbnail("x"));
  Ending ending = success(std::string(95, 'x'));
  ending.image->thumbnail = std::make_shared<const std::string>(zeros);
  finish(store, "a", ending);
  finish(store, "b", success("small"));
  store.create(job_like("c", "hash"), "body", {});
  for (const char* id : {"a", "c"}) {
    const auto found = store.thumbnail(id);
    CHECK(found->state == ImageState::present);
    CHECK(*found->image.bytes == zeros);
    CHECK(found->image.media_type == "image/png");
    CHECK(found->image.sha256 == sha256_hex(zeros));
  }
  CHECK(store.thumbnail("b")->state == ImageState::present);
  CHECK_FALSE(store.thumbnail("b")->image.bytes);

  Retention retention;
  retention.max_image_bytes = 105;
  store.expire(retention, noon);
  CHECK(store.image("a")->state == ImageState::present);
  retention.max_image_bytes = 104;
  store.expire(retention, noon);
  for (const char* id : {"a", "b"}) CHECK(store.thumbnail(id)->state == ImageState::expired);
  CHECK_FALSE(store.find("a")->size_bytes);
  CHECK(*store.thumbnail("c")->image.bytes == zeros);
  retention.max_image_bytes = 0;
  store.expire(retention, noon);
  CHECK(store.thumbnail("c")->state == ImageState::expired);
}

TEST_CASE_TEMPLATE("lists are newest first, by state, page after page", Store, MemoryStore, FreshSqliteStore) {
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

TEST_CASE_TEMPLATE("what is unfinished is known, oldest first", Store, MemoryStore, FreshSqliteStore) {
  Store store;
  for (const char* id : {"a", "b", "c"}) store.create(job_of(id), "body", {});
  store.start("b", noon);
  finish(store, "a", end_in(JobState::failed));
  CHECK(ids_of(store.unfinished()) == std::vector<std::string>{"b", "c"});
}

TEST_CASE_TEMPLATE("images and jobs expire by age and by number, oldest first", Store, MemoryStore, FreshSqliteStore) {
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

TEST_CASE_TEMPLATE("who ended first goes first, whoever came first", Store, MemoryStore, FreshSqliteStore) {
  Store store;
  for (const char* id : {"a", "b", "c"}) store.create(job_of(id), "body", {});
  int end = 0;
  for (const char* id : {"b", "c", "a"}) finish(store, id, success(std::string(100, *id), noon + seconds(++end)));
  Retention retention;
  retention.max_image_bytes = 250;
  store.expire(retention, noon + hours(1));
  CHECK(store.image("b")->state == ImageState::expired);
  CHECK(store.image("a")->state == ImageState::present);
  retention.max_jobs = 1;
  store.expire(retention, noon + hours(1));
  CHECK_FALSE(store.find("c"));
  CHECK(store.find("a"));
}

TEST_CASE_TEMPLATE("a job that is put back waits again, with the percentage it had", Store, MemoryStore,
                   FreshSqliteStore) {
  Store store;
  store.create(job_of("a"), "body", {});
  CHECK_FALSE(store.put_back("a", 30));
  store.start("a", noon);
  CHECK(store.put_back("a", 30));
  CHECK(store.find("a")->state == JobState::queued);
  CHECK(store.find("a")->percent == 30);
  CHECK_FALSE(store.find("a")->started_at);
  CHECK(store.spec("a") == "body");
  CHECK(store.start("a", noon));
  CHECK_FALSE(store.put_back("b", 0));
}

TEST_CASE_TEMPLATE("the image of an equal job is found again, as long as it is kept", Store, MemoryStore,
                   FreshSqliteStore) {
  Store store;
  store.create(job_like("a", "hash"), "body", {});
  CHECK(store.create(job_like("b", "hash"), "body", {}).job.state == JobState::queued);  // nothing is done yet
  finish(store, "a", success("bytes"));
  const Created again = store.create(job_like("c", "hash"), "body", IdempotencyKey{"key", "sum", ""});
  CHECK(again.outcome == Outcome::created);
  CHECK(again.job.state == JobState::succeeded);
  const auto found = store.find("c");
  CHECK(found->state == JobState::succeeded);
  CHECK(found->percent == 100);
  CHECK(found->finished_at == noon + seconds(2));  // not before the one that ended last, whatever the clock says
  CHECK(found->stats->render_s == 1.5);
  CHECK(found->size_bytes == 5);
  CHECK(again.job.size_bytes == 5);
  CHECK(store.spec("c") == "body");
  CHECK(*store.image("c")->image.bytes == "bytes");
  CHECK(ids_of(store.unfinished()) == std::vector<std::string>{"b"});
  CHECK(store.find_key({"key", "sum", ""})->job.id == "c");

  CHECK(store.create(job_like("d", "other"), "body", {}).job.state == JobState::queued);
  CHECK(store.create(job_like("e", ""), "body", {}).job.state == JobState::queued);
  finish(store, "e", success("more"));
  CHECK(store.create(job_like("f", ""), "body", {}).job.state == JobState::queued);

  // Each job has its image for itself.
  CHECK(store.remove("a"));
  CHECK(*store.image("c")->image.bytes == "bytes");
  CHECK(store.create(job_like("g", "hash"), "body", {}).job.state == JobState::succeeded);
  CHECK(store.remove("c"));
  CHECK(store.remove("g"));
  CHECK(store.create(job_like("h", "hash"), "body", {}).job.state == JobState::queued);
}

TEST_CASE_TEMPLATE("equal images count once, and go with the last job that has them", Store, MemoryStore,
                   FreshSqliteStore) {
  Store store;
  for (const char* id : {"a", "b", "c"}) {
    store.create(job_of(id), "body", {});
    finish(store, id, success(std::string(100, 'x')));
  }
  Retention retention;
  retention.max_image_bytes = 100;
  store.expire(retention, noon);
  CHECK(store.image("a")->state == ImageState::present);
  retention.max_jobs = 1;
  store.expire(retention, noon);
  CHECK(ids_of(store.list({}, 10, {}).jobs) == std::vector<std::string>{"c"});
  CHECK(*store.image("c")->image.bytes == std::string(100, 'x'));
}

TEST_CASE_TEMPLATE("owners see their jobs and use keys apart from each other", Store, MemoryStore, FreshSqliteStore) {
  Store store;
  store.create(job_like("a", "", "ann"), "body", IdempotencyKey{"key", "1", "ann"});
  CHECK(store.create(job_like("b", "", "bob"), "body", IdempotencyKey{"key", "2", "bob"}).outcome == Outcome::created);
  store.create(job_like("c", "", "ann"), "body", {});
  store.create(job_of("d"), "body", {});
  finish(store, "c", success("bytes"));
  CHECK(store.find("a")->owner == "ann");
  CHECK(store.find_key({"key", "1", "ann"})->job.id == "a");
  CHECK(store.find_key({"key", "2", "bob"})->job.id == "b");
  CHECK_FALSE(store.find_key({"key", "1", ""}));
  CHECK(ids_of(store.list({{}, "ann"}, 10, {}).jobs) == std::vector<std::string>{"c", "a"});
  CHECK(ids_of(store.list({JobState::queued, "ann"}, 10, {}).jobs) == std::vector<std::string>{"a"});
  CHECK(ids_of(store.list({{}, ""}, 10, {}).jobs) == std::vector<std::string>{"d"});
  const Page page = store.list({{}, "ann"}, 1, {});
  CHECK(ids_of(store.list({{}, "ann"}, 1, page.next_page_token).jobs) == std::vector<std::string>{"a"});
  CHECK(store.newest_id() == "d");
}

TEST_CASE_TEMPLATE("an image of another type has its preview beside it", Store, MemoryStore, FreshSqliteStore) {
  Store store;
  store.create(job_of("a"), "body", {});
  Ending ending = success("float bytes");
  ending.image->media_type = "image/x-exr";
  ending.image->png_preview = std::make_shared<const std::string>("png bytes");
  finish(store, "a", ending);
  const auto found = store.image("a");
  CHECK(found->image.media_type == "image/x-exr");
  CHECK(*found->image.png_preview == "png bytes");
}

TEST_CASE("SHA-256 of the standard's example") {
  CHECK(sha256_hex("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}
