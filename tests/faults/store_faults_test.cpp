#include <dlfcn.h>
#include <doctest/doctest.h>
#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <limits>

#include "tests/store/directories.h"
#include "tests/store/records.h"
#include "tests/support/faulty_calls.h"

// Every write, fsync and rename of a store's life fails once, one after the other, and every fifth allocation (with
// PENUMBRA_FULL=1 in the environment every one). Whatever fails, a call
// has either thrown or has an effect that is there after the next start; and that start finds a sound store.

using namespace penumbra::test;

namespace {

constexpr long for_ever = std::numeric_limits<long>::max();

template <class Function>
Function* preloaded(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_DEFAULT, name));
}

/// What the calls of one life have answered. Filled without allocations.
struct Answers {
  bool is_open = false, is_failed = false;
  bool a_created = false, a_started = false, a_finished = false;
  bool b_created = false, b_removed = false;
  bool c_created = false, c_ended = false;
  bool is_a_misread = false;
  int store_failures = 0, full = 0;
  long unsynced = 0;  // files, after any call that has returned
  decltype(&unsynced_files) count_unsynced = preloaded<decltype(unsynced_files)>("unsynced_files");

  template <class Call>
  bool made(const Call& call) {
    try {
      call();
      unsynced = std::max(unsynced, count_unsynced());
      return true;
    } catch (const StoreFailed&) {
      ++store_failures;
    } catch (const StorageFull&) {
      ++full;
    } catch (const std::exception&) {
      // Thrown cleanly.
    }
    return false;
  }
};

/// The values of a life, made before anything fails.
struct Script {
  JobRecord a = job_like("a", "hash", "ann"), b = job_of("b"), c = job_of("c");
  std::optional<IdempotencyKey> key = IdempotencyKey{"key", "sum", "ann"}, no_key;
  std::string body = std::string(20'000, 'b');
  Ending a_ends = success(std::string(10'000, 'a')), c_ends = end_in(JobState::failed);

  Script() { a_ends.image->png_preview = std::make_shared<const std::string>("the preview"); }
};

Answers live(const Script& script, const std::string& directory, std::atomic<bool>& has_failed) {
  Answers answers;
  answers.is_open = answers.made([&] {
    SqliteSettings settings = in_directory(directory);
    settings.on_failure = [&](const char*) { has_failed = true; };
    SqliteStore store(settings);
    answers.a_created = answers.made([&] { store.create(script.a, script.body, script.key); });
    answers.a_started = answers.made([&] { store.start("a", noon); });
    answers.b_created = answers.made([&] { store.create(script.b, script.body, script.no_key); });
    bool is_finished = false;
    answers.a_finished = answers.made([&] { is_finished = store.finish("a", script.a_ends); }) && is_finished;
    answers.made([&] {
      const auto found = store.image("a");
      answers.is_a_misread = answers.a_finished && *found->image.bytes != *script.a_ends.image->bytes;
    });
    answers.b_removed = answers.made([&] { store.remove("b"); });
    answers.c_created = answers.made([&] { store.create(script.c, script.body, script.no_key); });
    answers.c_ended = answers.made([&] { is_finished = store.finish("c", script.c_ends); }) && is_finished;
    answers.made([&] { store.expire({}, noon + seconds(5)); });
  });
  answers.is_failed = has_failed;
  return answers;
}

void check(const Script& script, const std::string& directory, const Answers& answers) {
  // What is known to have failed is not left as if it were sound.
  if (answers.is_failed) CHECK(fs::exists(directory + "/unclean"));
  std::ofstream(directory + "/unclean");  // every page is looked at
  SqliteStore store(in_directory(directory));
  const auto a = store.find("a"), b = store.find("b"), c = store.find("c");
  if (answers.a_created) {
    REQUIRE(a);
    CHECK(store.find_key(*script.key)->job.id == "a");
  }
  if (a && a->state == JobState::succeeded) {
    const auto found = store.image("a");
    REQUIRE(found->state == ImageState::present);
    CHECK(*found->image.bytes == *script.a_ends.image->bytes);
    CHECK(*found->image.png_preview == *script.a_ends.image->png_preview);
    CHECK(a->stats->render_s == 1.5);
  } else if (a) {
    CHECK_FALSE(answers.a_finished);
    CHECK(a->state == JobState::queued);
    CHECK(store.spec("a") == script.body);
  }
  if (answers.b_removed) CHECK_FALSE(b);
  if (answers.b_created && !answers.b_removed && b) CHECK(store.spec("b") == script.body);
  if (answers.c_created) REQUIRE(c);
  if (answers.c_ended) CHECK(c->state == JobState::failed);
  if (c && c->state == JobState::queued) CHECK(store.spec("c") == script.body);
  CHECK_FALSE(answers.is_a_misread);
  // What no row refers to is gone.
  CHECK(files_in(directory + "/blobs") == (a && a->state == JobState::succeeded ? 2 : 0));
  // Whoever was told of a failure is not alone: the server is.
  if (answers.store_failures > 0) CHECK(answers.is_failed);
  // And it goes on.
  CHECK(store.create(job_of("z"), "body", {}).outcome == Outcome::created);
}

struct Sweep {
  Fault kind;
  const char* name;
  int error;
  bool is_lasting;
  long step = 1;  // not every call, where there are thousands
};

void sweep(const Sweep& how) {
  const auto arm = preloaded<decltype(arm_fault)>("arm_fault");
  const auto disarm = preloaded<decltype(disarm_fault)>("disarm_fault");
  const Script script;
  long n = 1, failed_lives = 0, failed_stores = 0;
  for (;; n += how.step) {
    const TemporaryDirectory directory;
    std::atomic<bool> has_failed = false;
    arm(static_cast<int>(how.kind), n, how.is_lasting ? for_ever : n, how.error);
    const Answers answers = live(script, directory.path(), has_failed);
    const long calls = disarm();
    CAPTURE(how.name);
    CAPTURE(n);
    check(script, directory.path(), answers);
    if (calls < n) {
      CHECK(answers.c_ended);
      // What was answered does not wait in the kernel's memory.
      CHECK(answers.unsynced == 0);
      break;
    }
    const bool is_whole = answers.is_open && answers.a_finished && answers.b_removed && answers.c_ended;
    failed_lives += is_whole ? 0 : 1;
    failed_stores += answers.is_failed ? 1 : 0;
    if (how.kind == Fault::write && how.error == ENOSPC && !how.is_lasting && answers.is_open)
      CHECK(answers.store_failures == 0);
    // For want of descriptors nothing is in doubt; after a write that failed for another reason all is.
    if (how.kind == Fault::open && answers.is_open) CHECK(answers.store_failures == 0);
    if (how.kind == Fault::write && how.error == EIO && answers.is_open && !is_whole) CHECK(answers.is_failed);
    if (how.kind == Fault::part) CHECK(is_whole);
    if (how.kind == Fault::sync && answers.is_open && !is_whole) CHECK(answers.is_failed);
  }
  MESSAGE(std::string(how.name) << ": " << (n - 1) / how.step << " faults, " << failed_lives
                                << " with a call that threw, " << failed_stores << " ended the store");
  CHECK(n > 1);
}

}  // namespace

TEST_CASE("whatever fails, nothing that was answered is lost") {
  if (dlsym(RTLD_DEFAULT, "arm_fault") == nullptr) {
    // Once more, with the library that makes calls fail.
    const std::string library = PENUMBRA_BIN_DIR "/../lib/faulty_calls.so";
    REQUIRE(dlopen(library.c_str(), RTLD_LAZY) != nullptr);  // else it would start itself for ever
    std::string program = "/proc/self/exe", temporary = "TMPDIR=/dev/shm", preload = "LD_PRELOAD=" + library;
    std::string full = "PENUMBRA_FULL=1";
    char* const words[] = {program.data(), nullptr};
    char* const environment[] = {preload.data(), temporary.data(),
                                 std::getenv("PENUMBRA_FULL") != nullptr ? full.data() : nullptr, nullptr};
    pid_t child = 0;
    int status = 0;
    REQUIRE(posix_spawn(&child, words[0], nullptr, nullptr, words, environment) == 0);
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
    return;
  }
  spdlog::set_level(spdlog::level::off);
  const long step = std::getenv("PENUMBRA_FULL") != nullptr ? 1 : 5;
  for (const Sweep& how :
       {Sweep{Fault::write, "a write to a full disk", ENOSPC, false},
        Sweep{Fault::write, "every write from then on to a full disk", ENOSPC, true},
        Sweep{Fault::write, "a write that fails", EIO, false},
        Sweep{Fault::write, "every write from then on", EIO, true}, Sweep{Fault::sync, "an fsync", EIO, false},
        Sweep{Fault::sync, "every fsync from then on", EIO, true}, Sweep{Fault::rename, "a rename", EIO, false},
        Sweep{Fault::open, "an open without descriptors", EMFILE, false},
        Sweep{Fault::part, "every read and write a part from then on", 0, true, 20},
        Sweep{Fault::allocation, "an allocation", ENOMEM, false, step}})
    sweep(how);
}
