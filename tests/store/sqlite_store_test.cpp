#include <doctest/doctest.h>

#include <atomic>
#include <fstream>
#include <random>
#include <thread>

#include "tests/store/directories.h"
#include "tests/store/records.h"
#include "tests/support/memory_store.h"

// What the durable store does beyond the suite.

using namespace penumbra::test;

TEST_CASE("everything is there again after a stop, and after a crash") {
  const TemporaryDirectory directory;
  const std::string open = directory / "open", crashed = directory / "crashed";
  {
    SqliteStore store(in_directory(open));
    for (const char* id : {"a", "b", "c", "d"}) store.create(job_like(id, id, "ann"), "body", {});
    store.create(job_of("e"), "the body", IdempotencyKey{"key", "sum", ""});
    finish(store, "a", success("bytes"));
    finish(store, "b", end_in(JobState::failed));
    store.start("c", noon);
    copy_open_store(open, crashed);
    store.put_back("c", 12);
  }
  CHECK_FALSE(fs::exists(open + "/unclean"));
  CHECK(fs::exists(crashed + "/unclean"));
  for (const std::string& path : {open, crashed}) {
    SqliteStore store(in_directory(path));
    CHECK(store.find("a")->state == JobState::succeeded);
    CHECK(store.find("a")->owner == "ann");
    CHECK(*store.image("a")->image.bytes == "bytes");
    CHECK(store.find("b")->error->detail == "it broke");
    CHECK(store.find("c")->state == JobState::queued);
    CHECK(store.find("c")->crashes == (path == crashed ? 1 : 0));
    CHECK(store.find("c")->percent == (path == crashed ? 0 : 12));
    CHECK(ids_of(store.unfinished()) == std::vector<std::string>{"c", "d", "e"});
    CHECK(store.spec("e") == "the body");
    CHECK(store.find_key({"key", "sum", ""})->job.id == "e");
    CHECK(store.create(job_like("f", "a"), "body", {}).job.state == JobState::succeeded);
  }
}

TEST_CASE("files of images go when the last job that has them goes") {
  const TemporaryDirectory directory;
  SqliteStore store(in_directory(directory.path()));
  for (const char* id : {"a", "b"}) {
    store.create(job_of(id), "body", {});
    Ending ending = success("float bytes");
    ending.image->png_preview = std::make_shared<const std::string>("png bytes");
    finish(store, id, ending);
  }
  store.create(job_of("c"), "body", {});
  finish(store, "c", success("png bytes"));
  store.remove("a");
  CHECK(files_in(directory / "blobs") == 2);
  store.remove("b");
  CHECK(files_in(directory / "blobs") == 1);
  CHECK(*store.image("c")->image.bytes == "png bytes");
  store.remove("c");
  CHECK(files_in(directory / "blobs") == 0);
}

TEST_CASE("a preview that another job is about to refer to stays when its own job's image goes") {
  const TemporaryDirectory directory;
  SqliteStore store(in_directory(directory.path()));
  const auto with_preview = [](const std::string& bytes) {
    Ending ending = success(bytes);
    ending.image->png_preview = std::make_shared<const std::string>("png bytes");
    return ending;
  };
  for (const char* id : {"a", "b"}) {
    store.create(job_of(id), "body", {});
    store.start(id, noon);
  }
  REQUIRE(store.finish("a", with_preview("float bytes")));
  // While the image of the one is about to go, that of the other is stored, and its row has to wait.
  std::jthread other;
  Retention retention;
  retention.image_age = seconds(1);
  retention.is_held = [&](const std::string& id) {
    if (!other.joinable()) other = std::jthread([&] { CHECK(store.finish("b", with_preview("other bytes"))); });
    while (!fs::exists(blob_path(directory.path(), "other bytes"))) std::this_thread::yield();
    return id == "b";
  };
  store.expire(retention, noon + hours(1));
  other.join();
  CHECK(store.image("a")->state == ImageState::expired);
  const auto found = store.image("b");
  REQUIRE(found->state == ImageState::present);
  CHECK(*found->image.png_preview == "png bytes");
}

TEST_CASE_TEMPLATE("a preview counts with its image", Store, MemoryStore, FreshSqliteStore) {
  Store store;
  store.create(job_of("a"), "body", {});
  Ending ending = success("float bytes");
  ending.image->png_preview = std::make_shared<const std::string>("png bytes");
  finish(store, "a", ending);
  Retention retention;
  retention.max_image_bytes = 11 + 9;
  store.expire(retention, noon);
  CHECK(store.image("a")->state == ImageState::present);
  --retention.max_image_bytes;
  store.expire(retention, noon);
  CHECK(store.image("a")->state == ImageState::expired);
}

TEST_CASE("what was removed once is not looked at again") {
  const TemporaryDirectory directory;
  SqliteStore store(in_directory(directory.path()));
  store.create(job_of("a"), "body", {});
  finish(store, "a", success("bytes"));
  store.remove("a");
  const std::string path = blob_path(directory.path(), "bytes");
  REQUIRE_FALSE(fs::exists(path));
  std::ofstream(path) << "somebody's";
  store.create(job_of("b"), "body", {});
  CHECK(fs::exists(path));
}

TEST_CASE("an image whose file is gone or damaged has expired and is not found again") {
  const TemporaryDirectory directory;
  SqliteStore store(in_directory(directory.path()));
  store.create(job_like("a", "hash"), "body", {});
  finish(store, "a", success("bytes"));
  int jobs = 0;
  for (const bool is_damaged : {true, false}) {
    const std::string path = blob_path(directory.path(), "bytes"), next = "b" + std::to_string(jobs++);
    if (is_damaged) {
      std::ofstream(path) << "bytez";
    } else {
      fs::remove(path);
    }
    CHECK(store.image("a")->state == ImageState::expired);
    CHECK(store.create(job_like(next, "hash"), "body", {}).job.state == JobState::queued);
    finish(store, next, success("bytes"));
    CHECK(*store.image("a")->image.bytes == "bytes");
  }
}

TEST_CASE("who reads an image while others do shares their bytes") {
  const TemporaryDirectory directory;
  SqliteStore store(in_directory(directory.path()));
  store.create(job_of("a"), "body", {});
  finish(store, "a", success("bytes"));
  const auto first = store.image("a"), second = store.image("a");
  CHECK(first->image.bytes == second->image.bytes);
}

TEST_CASE("an empty database beside images is not taken for a new one; alone, and behind a link, it is") {
  const TemporaryDirectory directory;
  {
    SqliteStore store(in_directory(directory.path()));
    store.create(job_of("a"), "body", {});
    finish(store, "a", success("bytes"));
  }
  // To SQLite one byte is none; one that is cut off later is there, though damaged.
  for (const std::uintmax_t size : {2, 1, 0}) {
    fs::resize_file(directory / "penumbra.db", size);
    std::string why;
    try {
      const SqliteStore store(in_directory(directory.path()));
    } catch (const std::runtime_error& error) {
      why = error.what();
    }
    CHECK(why.ends_with("the database is missing") == (size < 2));
    CHECK_FALSE(why.empty());
    CHECK(fs::exists(blob_path(directory.path(), "bytes")));
  }
  const TemporaryDirectory other;
  fs::create_directory(other / "real");
  fs::create_directory_symlink("real", other / "link");
  std::ofstream(other / "real/penumbra.db").flush();
  SqliteStore store(in_directory(other / "link"));
  store.create(job_of("a"), "body", {});
  CHECK(fs::file_size(other / "real/penumbra.db") > 0);
  fs::create_directories(other / "real/deep");
  SqliteStore(in_directory(other / "link/deep/er")).create(job_of("a"), "body", {});
}

TEST_CASE("another engine's images are not found again") {
  const TemporaryDirectory directory;
  SqliteSettings settings = in_directory(directory.path());
  {
    SqliteStore store(settings);
    store.create(job_like("a", "hash"), "body", {});
    finish(store, "a", success("bytes"));
    store.create(job_like("b", "other"), "body", {});
  }
  settings.engine_version = "2";
  SqliteStore store(settings);
  CHECK(store.create(job_like("c", "hash"), "body", {}).job.state == JobState::queued);
  CHECK(store.find("b")->spec_hash.empty());
  CHECK(*store.image("a")->image.bytes == "bytes");
}

TEST_CASE("a clock that is set back loses and reorders nothing") {
  const TemporaryDirectory directory;
  {
    SqliteStore store(in_directory(directory.path()));
    store.create(job_of("a", noon), "body", {});
    finish(store, "a", success("one", noon));
    store.create(job_of("b", noon - hours(100)), "body", {});
    finish(store, "b", success("two", noon - hours(100)));
    store.expire({}, noon - hours(100));
  }
  SqliteStore store(in_directory(directory.path()));
  CHECK(ids_of(store.list({}, 10, {}).jobs) == std::vector<std::string>{"b", "a"});
  CHECK(store.newest_id() == "b");
  Retention retention;
  retention.max_image_bytes = 3;
  store.expire(retention, noon - hours(99));
  // The older one goes, whatever the clock said.
  CHECK(store.image("a")->state == ImageState::expired);
  CHECK(store.image("b")->state == ImageState::present);
}

TEST_CASE("below the reserve no job is taken, but those that are there end") {
  const TemporaryDirectory directory;
  SqliteSettings settings = in_directory(directory.path());
  SqliteStore(settings).create(job_of("a"), "body", {});
  settings.disk_reserve_bytes = ~std::uint64_t{0};
  SqliteStore store(settings);
  CHECK_THROWS_AS(store.create(job_of("b"), "body", {}), StorageFull);
  CHECK_FALSE(store.find("b"));
  finish(store, "a", success("bytes"));
  CHECK(store.image("a")->state == ImageState::present);
}

TEST_CASE("many threads share commits, and none is lost") {
  const TemporaryDirectory directory;
  constexpr int threads = 16, jobs = 40;
  {
    SqliteStore store(in_directory(directory.path()));
    std::vector<std::jthread> clients;
    for (int thread = 0; thread < threads; ++thread) {
      clients.emplace_back([&store, thread] {
        for (int job = 0; job < jobs; ++job) {
          const std::string id = std::to_string(1000 * thread + job);
          store.create(job_of(id), "body", {});
          store.start(id, noon);
          if (job % 2 == 0) store.finish(id, success("image " + std::to_string(job)));
          if (job % 3 == 0) store.remove(id);
        }
      });
    }
  }
  const SqliteStore store(in_directory(directory.path()));
  for (int thread = 0; thread < threads; ++thread) {
    for (int job = 0; job < jobs; ++job) {
      const auto found = store.find(std::to_string(1000 * thread + job));
      REQUIRE(found.has_value() == (job % 3 != 0));
      if (found) CHECK(found->state == (job % 2 == 0 ? JobState::succeeded : JobState::queued));
      if (found && job % 2 == 0) CHECK(*store.image(found->id)->image.bytes == "image " + std::to_string(job));
    }
  }
}

TEST_CASE("ten thousand jobs are listed, counted and expired") {
  FreshSqliteStore store;
  std::atomic<int> next = 0;
  {
    std::vector<std::jthread> clients;
    for (int i = 0; i < 64; ++i) {
      clients.emplace_back([&] {
        for (int job = next++; job < 10'000; job = next++) {
          const std::string id = std::to_string(100'000 + job);
          store.create(job_like(id, id, job % 100 == 0 ? "ann" : "bob"), "body", {});
          if (job % 10 != 0) store.finish(id, end_in(JobState::canceled));
        }
      });
    }
  }
  CHECK(store.unfinished().size() == 1000);
  CHECK(ids_of(store.list({{}, "ann"}, 2, {}).jobs) == std::vector<std::string>{"109900", "109800"});
  CHECK(store.list({JobState::canceled, {}}, 1000, "105000").jobs.front().id == "104999");
  Retention retention;
  retention.max_jobs = 100;
  store.expire(retention, noon);
  CHECK(store.list({JobState::canceled, {}}, 1000, {}).jobs.size() == 100);
  CHECK(store.unfinished().size() == 1000);
}

namespace {

/// Two stores that are told the same, of which one is closed and opened again now and then.
struct Twins {
  explicit Twins(const std::string& path) : directory(path), durable(open()) {
    retention.max_jobs = 15;
    retention.max_image_bytes = 60;
  }
  std::unique_ptr<SqliteStore> open() const { return std::make_unique<SqliteStore>(in_directory(directory)); }
  int below(unsigned n) { return static_cast<int>(random() % n); }

  void create() {
    const std::string fresh = std::to_string(10'000 + jobs++), some = std::to_string(below(5));
    const JobRecord job = job_like(fresh, below(2) == 0 ? "" : some, below(2) == 0 ? "" : "ann");
    std::optional<IdempotencyKey> key;
    if (below(2) == 0) key = IdempotencyKey{some, std::to_string(below(2)), job.owner};
    const Created a = plain.create(job, "body " + fresh, key), b = durable->create(job, "body " + fresh, key);
    REQUIRE(a.outcome == b.outcome);
    REQUIRE(a.job.id == b.job.id);
    REQUIRE(a.job.state == b.job.state);
  }
  void finish(const std::string& id, const Ending& ending) {
    REQUIRE(plain.finish(id, ending) == durable->finish(id, ending));
  }
  void expire() {
    const Time now = noon + hours(below(40));
    plain.expire(retention, now);
    durable->expire(retention, now);
    if (below(20) != 0) return;
    for (const JobRecord& job : plain.unfinished()) {
      plain.put_back(job.id, 7);
      durable->put_back(job.id, 7);
    }
    durable.reset();
    durable = open();
  }
  void compare() {
    const Page a = plain.list({}, 100, {}), b = durable->list({}, 100, {});
    REQUIRE(ids_of(a.jobs) == ids_of(b.jobs));
    REQUIRE(ids_of(plain.unfinished()) == ids_of(durable->unfinished()));
    for (std::size_t i = 0; i < a.jobs.size(); ++i) {
      REQUIRE(a.jobs[i].state == b.jobs[i].state);
      REQUIRE(a.jobs[i].percent == b.jobs[i].percent);
      const auto own = plain.image(a.jobs[i].id), other = durable->image(a.jobs[i].id);
      REQUIRE(own->state == other->state);
      if (own->state == ImageState::present) REQUIRE(*own->image.bytes == *other->image.bytes);
    }
  }

  std::string directory;
  MemoryStore plain;
  std::unique_ptr<SqliteStore> durable;
  std::mt19937 random{11};
  int jobs = 0;
  Retention retention;
};

}  // namespace

TEST_CASE("any order of calls leaves the durable store as the plain one") {
  const TemporaryDirectory directory;
  Twins twins(directory.path());
  for (int step = 0; step < 3000; ++step) {
    const std::string id = std::to_string(10'000 + twins.below(static_cast<unsigned>(twins.jobs) + 1));
    switch (twins.below(9)) {
      case 0:
      case 1:
        twins.create();
        break;
      case 2:
        REQUIRE(twins.plain.start(id, noon) == twins.durable->start(id, noon));
        break;
      case 3:
        REQUIRE(twins.plain.put_back(id, 5) == twins.durable->put_back(id, 5));
        break;
      case 4:
      case 5: {
        const std::string some = std::to_string(twins.below(5));
        twins.finish(id, success("image " + some, noon + hours(twins.below(30))));
        break;
      }
      case 6:
        twins.finish(id, end_in(twins.below(2) == 0 ? JobState::canceled : JobState::failed));
        break;
      case 7:
        if (twins.below(4) == 0) REQUIRE(twins.plain.remove(id) == twins.durable->remove(id));
        break;
      default:
        twins.expire();
    }
    twins.compare();
  }
}
