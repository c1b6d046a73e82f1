#include <doctest/doctest.h>
#include <sqlite3.h>

#include <fstream>
#include <random>

#include "tests/store/directories.h"
#include "tests/store/records.h"

// A start on what a crash, another program or a broken disk has left.

using namespace penumbra::test;

namespace {

/// Runs SQL on the database of a store that is closed.
void run_sql(const std::string& directory, const std::string& sql) {
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open((directory + "/penumbra.db").c_str(), &database) == SQLITE_OK);
  char* message = nullptr;
  const int code = sqlite3_exec(database, sql.c_str(), nullptr, nullptr, &message);
  CHECK_MESSAGE(code == SQLITE_OK, (message != nullptr ? message : ""));
  sqlite3_free(message);
  sqlite3_close(database);
}

std::string complaint_of(const std::string& directory) {
  try {
    const SqliteStore store(in_directory(directory));
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("a job the server has died of three times has failed") {
  const TemporaryDirectory directory;
  std::string path = directory / "0";
  SqliteStore(in_directory(path)).create(job_of("a"), "body", {});
  for (int crash = 1; crash <= 3; ++crash) {
    SqliteStore store(in_directory(path));
    REQUIRE(store.start("a", noon));
    path = directory / std::to_string(crash);
    copy_open_store(directory / std::to_string(crash - 1), path);
  }
  const SqliteStore store(in_directory(path));
  CHECK(store.find("a")->state == JobState::failed);
  CHECK(store.find("a")->error->type == "/problems/crashed");
  CHECK(store.find("a")->finished_at);
  CHECK(store.unfinished().empty());
}

TEST_CASE("one server at a time") {
  const TemporaryDirectory directory;
  {
    const SqliteStore store(in_directory(directory.path()));
    CHECK(contains(complaint_of(directory.path()), "in use by another server"));
  }
  CHECK(complaint_of(directory.path()).empty());
}

TEST_CASE("what interrupted writes and dropped rows left is removed, and nothing else") {
  const TemporaryDirectory directory;
  {
    SqliteStore store(in_directory(directory.path()));
    store.create(job_of("a"), "body", {});
    finish(store, "a", success("kept"));
  }
  const std::string orphan = blob_path(directory.path(), "orphan"), part = blob_path(directory.path(), "x") + ".3.part";
  const std::string foreign = directory / "blobs/ab/notes.txt", outside = directory / "blobs/README";
  for (const std::string& path : {orphan, part, foreign, outside}) std::ofstream(path) << "bytes";
  const TemporaryDirectory elsewhere;
  std::ofstream(elsewhere / sha256_hex("y")) << "bytes";
  fs::remove(directory / "blobs/cc");
  fs::create_directory_symlink(elsewhere.path(), directory / "blobs/cc");
  {
    const SqliteStore store(in_directory(directory.path()));
    CHECK(*store.image("a")->image.bytes == "kept");
  }
  CHECK_FALSE(fs::exists(orphan));
  CHECK_FALSE(fs::exists(part));
  CHECK(fs::exists(foreign));
  CHECK(fs::exists(outside));
  CHECK(files_in(elsewhere.path()) == 1);
}

TEST_CASE("databases that are not this version's are refused, and nothing is touched") {
  const TemporaryDirectory directory;
  const std::string path = directory / "store", before = directory / "before";
  {
    SqliteStore store(in_directory(path));
    store.create(job_of("a"), "body", {});
    finish(store, "a", success("bytes"));
  }
  copy_open_store(path, before);
  std::string expected;
  SUBCASE("a newer one") {
    run_sql(path, "PRAGMA user_version = 3");
    expected = "newer";
  }
  SUBCASE("other tables") {
    run_sql(path, "ALTER TABLE jobs ADD COLUMN more TEXT");
    expected = "tables";
  }
  SUBCASE("another program's") {
    run_sql(path, "PRAGMA application_id = 7");
    expected = "not one of Penumbra";
  }
  SUBCASE("another program's that has no number") {
    run_sql(path, "PRAGMA application_id = 0; PRAGMA user_version = 0");
    expected = "not one of Penumbra";
  }
  SUBCASE("no database at all") {
    fs::remove(path + "/penumbra.db");
    std::ofstream(path + "/penumbra.db") << std::string(5000, 'x');
    expected = "not a database";
  }
  SUBCASE("the database is missing") {
    fs::remove(path + "/penumbra.db");
    expected = "missing";
  }
  SUBCASE("the file is cut") {
    fs::resize_file(path + "/penumbra.db", 4096 * 3);
    std::ofstream(path + "/unclean");
    expected = "cannot be used";
  }
  const std::string complaint = complaint_of(path);
  CHECK_MESSAGE(contains(complaint, expected), complaint);
  CHECK(fs::exists(blob_path(path, "bytes")));
  for (const char* more : {"-wal", "-shm"}) fs::remove(path + "/penumbra.db" + more);
  fs::copy_file(before + "/penumbra.db", path + "/penumbra.db", fs::copy_options::overwrite_existing);
  CHECK(*SqliteStore(in_directory(path)).image("a")->image.bytes == "bytes");
}

TEST_CASE("a store of version 1.0 is taken over with all it holds") {
  const TemporaryDirectory directory;
  const std::string old = std::string(PENUMBRA_SOURCE_DIR) + "/tests/store/version-1";
  fs::copy(old + "/blobs", directory / "blobs", fs::copy_options::recursive);
  run_sql(directory.path(), read_file(old + "/penumbra.sql"));
  std::string newest;
  {
    SqliteStore store(in_directory(directory.path()));
    const std::vector<JobRecord> jobs = store.list({}, 10, {}).jobs;
    REQUIRE(jobs.size() == 6);
    // Newest first: what was not done has its body, and what that says.
    CHECK(jobs[0].name.empty());
    CHECK(jobs[0].shape->width == 800);
    CHECK(jobs[0].shape->height == 800);
    CHECK(jobs[0].shape->format == penumbra::scene::ImageFormat::png);
    CHECK(jobs[1].name == "Wei\u00df \"x\"");
    CHECK(jobs[1].shape->width == 6);
    CHECK(jobs[1].shape->height == 5);
    CHECK(jobs[1].shape->format == penumbra::scene::ImageFormat::exr);
    CHECK(store.spec(jobs[1].id)->starts_with("{ \"scene\""));
    CHECK(store.unfinished().size() == 3);
    // Of what was done version 1.0 has kept the image alone.
    for (const std::size_t i : {3, 4, 5}) {
      CHECK_FALSE(jobs[i].shape);
      CHECK_FALSE(store.spec(jobs[i].id));
      CHECK(jobs[i].size_bytes == store.image(jobs[i].id)->image.bytes->size());
      CHECK(store.thumbnail(jobs[i].id)->state == ImageState::present);
    }
    CHECK(store.image(jobs[3].id)->image.media_type == "image/x-exr");
    // The bodies are counted: 856 bytes, 228 of them the newest one's.
    newest = jobs[0].id;
    finish(store, newest, end_in(JobState::failed));
    Retention retention;
    retention.max_spec_bytes = 856;
    store.expire(retention, jobs[0].created_at);
    CHECK(store.spec(newest));
    retention.max_spec_bytes = 855;
    store.expire(retention, jobs[0].created_at);
    CHECK_FALSE(store.spec(newest));
  }
  const SqliteStore store(in_directory(directory.path()));
  CHECK(store.find(newest)->shape->width == 800);
  CHECK(store.unfinished().size() == 2);
}

TEST_CASE("no byte of a damaged database can crash a start") {
  const TemporaryDirectory directory;
  const std::string good = directory / "good", bad = directory / "bad";
  {
    SqliteStore store(in_directory(good));
    for (int i = 0; i < 20; ++i) store.create(job_of("job" + std::to_string(i)), std::string(500, 'b'), {});
    finish(store, "job3", success("bytes"));
    finish(store, "job4", end_in(JobState::failed));
  }
  std::mt19937 random(7);
  const auto size = fs::file_size(good + "/penumbra.db");
  int refused = 0;
  copy_open_store(good, bad);
  for (int i = 0; i < 60; ++i) {
    std::ofstream(bad + "/unclean");
    std::ofstream(blob_path(bad, "bytes")) << "bytes";
    for (const char* more : {"-wal", "-shm"}) fs::remove(bad + "/penumbra.db" + more);
    fs::copy_file(good + "/penumbra.db", bad + "/penumbra.db", fs::copy_options::overwrite_existing);
    {
      std::fstream file(bad + "/penumbra.db", std::ios::in | std::ios::out | std::ios::binary);
      for (int j = 0; j < 30; ++j) {
        file.seekp(static_cast<std::streamoff>(random() % size));
        file.put(static_cast<char>(random()));
      }
    }
    try {
      const SqliteStore store(in_directory(bad));
      store.unfinished();
      store.list({}, 100, {});
      for (int job = 0; job < 20; ++job) store.image("job" + std::to_string(job));
    } catch (const std::runtime_error&) {
      ++refused;
      CHECK(fs::exists(blob_path(bad, "bytes")));
    }
  }
  CHECK(refused > 30);
}
