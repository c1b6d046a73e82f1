#include <doctest/doctest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include "tests/server/fixture.h"

namespace {

using Clock = std::chrono::steady_clock;

/// `penumbra serve` as a process of its own.
class Process {
 public:
  /// With a store of its own unless `arguments` name one.
  explicit Process(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {PENUMBRA_BIN_DIR "/penumbra", "serve"});
    if (std::find(arguments.begin(), arguments.end(), "--store") == arguments.end())
      arguments.insert(arguments.end(), {"--store", store_ / "store"});
    std::vector<char*> words;
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", 1, 0);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    REQUIRE(posix_spawn(&id_, words[0], &actions, nullptr, words.data(), environ) == 0);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    output_ = fdopen(ends[0], "r");
  }
  ~Process() {
    if (id_ > 0) {
      kill(SIGKILL);
      exit_status();
    }
    fclose(output_);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  std::string line() {
    char text[256] = "";
    return std::fgets(text, sizeof text, output_) != nullptr ? text : "";
  }
  /// From the line that says where it listens.
  int port() {
    const std::string text = line();
    REQUIRE(text.starts_with("listening on http://127.0.0.1:"));
    return std::stoi(text.substr(text.rfind(':') + 1));
  }
  void kill(int signal) const { ::kill(id_, signal); }
  int exit_status() {
    int status = 0;
    waitpid(id_, &status, 0);
    id_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  penumbra::test::TemporaryDirectory store_;
  pid_t id_ = 0;
  FILE* output_ = nullptr;
};

nlohmann::json queued_jobs(int port) {
  return nlohmann::json::parse(call(port, "GET", "/v1/jobs?state=queued").body).at("jobs");
}

bool is_running(int port, const std::string& id) {
  return nlohmann::json::parse(call(port, "GET", "/v1/jobs/" + id).body).at("state") == "running";
}

}  // namespace

TEST_CASE("a signal ends the server cleanly while it renders, streams and waits") {
  int signal = 0;
  SUBCASE("SIGTERM") { signal = SIGTERM; }
  SUBCASE("SIGINT") { signal = SIGINT; }
  const penumbra::test::TemporaryDirectory store;
  const std::vector<std::string> arguments{"--listen", "127.0.0.1:0", "--jobs", "1", "--store", store.path()};
  Process server(arguments);
  const int port = server.port();
  const std::string id = nlohmann::json::parse(post(port, "/v1/jobs", endless_job()).body).at("id");
  Client stream(port), waiting(port), idle(port);
  CHECK(idle.request("GET", "/healthz")->status == 200);
  stream.send("GET /v1/jobs/" + id + "/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
  REQUIRE(stream.head()->status == 200);
  CHECK(stream.event()->name == "progress");
  // As long as it is queued itself, it would be taken for the one that waits.
  REQUIRE(eventually([&] { return is_running(port, id); }));
  const std::string body = endless_job(fresh_seed());
  waiting.send("POST /v1/render HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\nContent-Length: " +
               std::to_string(body.size()) + "\r\n\r\n" + body);
  REQUIRE(eventually([&] { return queued_jobs(port).size() == 1; }));
  const std::string waiting_id = queued_jobs(port).at(0).at("id");
  CHECK(waiting_id > id);

  const auto start = Clock::now();
  server.kill(signal);
  if (signal == SIGTERM) {
    // Who tells a process group may tell its members again, and somebody may reload the keys.
    for (const int again : {SIGTERM, SIGHUP}) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      server.kill(again);
    }
  }
  auto event = stream.event();
  while (event && event->name == "progress") event = stream.event();
  CHECK_FALSE(event);  // the stream has ended, the job has not
  const auto refused = waiting.reply();
  REQUIRE(refused);
  CHECK(refused->status == 503);
  CHECK(idle.is_closed_by_server());
  CHECK(server.exit_status() == 0);
  CHECK(Clock::now() - start < std::chrono::seconds(10));

  // The next server goes on with both.
  Process next(arguments);
  const int next_port = next.port();
  CHECK(eventually([&] { return is_running(next_port, id); }));
  const nlohmann::json jobs = queued_jobs(next_port);
  REQUIRE(jobs.size() == 1);
  CHECK(jobs[0].at("id") == waiting_id);
}

TEST_CASE("a second server on the same store is refused, and says why") {
  const penumbra::test::TemporaryDirectory store;
  Process first({"--listen", "127.0.0.1:0", "--store", store.path()});
  first.port();
  Process second({"--listen", "127.0.0.1:0", "--store", store.path()});
  CHECK(second.line().empty());
  CHECK(second.exit_status() == 1);
}

TEST_CASE("a server without room on its disk takes no jobs") {
  Process server({"--listen", "127.0.0.1:0", "--disk-reserve", "1E"});
  const int port = server.port();
  for (const char* path : {"/v1/jobs", "/v1/render"}) {
    const Reply refused = post(port, path, small_job());
    CHECK(refused.status == 507);
    CHECK(nlohmann::json::parse(refused.body).at("type") == "/problems/insufficient-storage");
  }
  CHECK(nlohmann::json::parse(call(port, "GET", "/v1/jobs").body).at("jobs").empty());
  CHECK(call(port, "GET", "/readyz").status == 200);
}

TEST_CASE("a port that is taken is an error") {
  Process first({"--listen", "127.0.0.1:0"});
  Process second({"--listen", "127.0.0.1:" + std::to_string(first.port())});
  CHECK(second.line().empty());
  CHECK(second.exit_status() == 1);
}

TEST_CASE("addresses that are wrong, or that others can reach, are refused") {
  for (const char* address :
       {"0.0.0.0:0", "[::]:0", "example.org:0", "127.0.0.1", "127.0.0.1:x", "127.0.0.1:70000", ""}) {
    Process server({"--listen", address});
    CHECK_MESSAGE(server.exit_status() == 2, address);
  }
  Process other_store({"--listen", "127.0.0.1:0", "--store", "postgresql://localhost/x"});
  CHECK(other_store.exit_status() == 2);
}

TEST_CASE("who says so may listen everywhere") {
  Process server({"--listen", "0.0.0.0:0", "--allow-public"});
  CHECK(server.line().starts_with("listening on http://0.0.0.0:"));
  server.kill(SIGTERM);
  CHECK(server.exit_status() == 0);
}
