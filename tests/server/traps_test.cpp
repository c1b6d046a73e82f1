// The traps of cpp-httplib 0.11, and which test fails when one of them is open again.
//
//   backlog of 5 is baked in               tests/serve/system_test.py: a burst of clients is let in at once
//   Nagle is on                            here: accepted connections do not wait for acknowledgements
//   no payload limit for chunked bodies    hostile_test.cpp: requests that cannot be framed are refused at once
//   compressed bodies inflate              encoding_test.cpp: limits hold while a body is inflated
//   answers are in parts                   here: no answer is in parts
//   headers are unbounded                  hostile_test.cpp: header fields have a budget
//   slow senders hold a thread each        hostile_test.cpp: slow senders are cut, wherever they stop
//   std::regex recursion on long paths     hostile_test.cpp: 414; here: the longest path and query are no trouble
//   an unread body is the next request     hostile_test.cpp: a body that nobody reads is never taken for a request
//   no Content-Length waits for a timeout  here: a POST without a length is answered at once, one with length 0 works
//   SO_REUSEPORT                           process_test.cpp: a port that is taken is an error
//   exception text in a header             here: what a handler throws stays inside
//   one thread for each event stream       events_test.cpp: streams are limited; access_test.cpp: shared out
//   dead clients are noticed late          here: the slot of a client that left is free soon
//   stop() waits for open connections      process_test.cpp: a signal ends the server cleanly
//   a dropped task leaks its descriptor    here: refused connections leave no descriptor open
//
// tests/traps/run opens them again one by one, and shows that these tests fail.
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "tests/server/fixture.h"

using namespace penumbra;
using Clock = std::chrono::steady_clock;

namespace {

std::size_t open_descriptors() {
  const std::filesystem::directory_iterator descriptors("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(descriptors), end(descriptors)));
}

/// The sockets of this process that listen on `port` have accepted: those whose own port it is and that have a peer.
std::vector<int> accepted_on(int port) {
  std::vector<int> sockets;
  for (int descriptor = 3; descriptor < 1024; ++descriptor) {
    sockaddr_in own{}, peer{};
    socklen_t size = sizeof own, peer_size = sizeof peer;
    if (::getsockname(descriptor, reinterpret_cast<sockaddr*>(&own), &size) == 0 && own.sin_family == AF_INET &&
        ntohs(own.sin_port) == port && ::getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &peer_size) == 0)
      sockets.push_back(descriptor);
  }
  return sockets;
}

}  // namespace

TEST_CASE("accepted connections do not wait for acknowledgements") {
  const TestServer server;
  Client client(server.port());
  REQUIRE(client.request("GET", "/healthz")->status == 200);
  const std::vector<int> accepted = accepted_on(server.port());
  REQUIRE(accepted.size() == 1);
  int is_set = 0;
  socklen_t size = sizeof is_set;
  REQUIRE(::getsockopt(accepted[0], IPPROTO_TCP, TCP_NODELAY, &is_set, &size) == 0);
  CHECK(is_set != 0);
}

TEST_CASE("no answer is in parts") {
  const TestServer server;
  std::ifstream file(PENUMBRA_SOURCE_DIR "/clients/web/app.js");
  const std::string whole{std::istreambuf_iterator<char>(file), {}};
  REQUIRE_FALSE(whole.empty());
  std::string ranges = "Range: bytes=0-0";
  for (int i = 0; i < 2000; ++i) ranges += ",0-" + std::to_string(i);
  for (const std::string& field : {ranges, "Range: " + std::string(9000, '1'), std::string("Range: bytes=0-9")}) {
    const Reply reply = call(server.port(), "GET", "/app.js", "", field + "\r\n");
    CHECK(reply.status == 200);
    CHECK(reply.body == whole);
  }
}

TEST_CASE("the longest path and query are no trouble") {
  const TestServer server;
  CHECK(call(server.port(), "GET", "/" + std::string(199, 'a')).status == 404);
  CHECK(call(server.port(), "GET", "/" + std::string(200, 'a')).status == 414);
  CHECK(post(server.port(), "/v1/" + std::string(196, 'a'), "{}").status == 404);
  CHECK(call(server.port(), "GET", "/?limit=1&x=" + std::string(2000, 'a')).status == 200);
  CHECK(call(server.port(), "GET", "/v1/jobs?x=" + std::string(2048, 'a')).status == 414);
}

TEST_CASE("a POST without a length is answered at once, one with length 0 works") {
  const TestServer server;
  const std::string id = server.submit(endless_job());
  const auto start = Clock::now();
  Client client(server.port());
  client.send("POST /v1/jobs HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\n\r\n");
  CHECK(client.reply()->status == 411);
  CHECK(Clock::now() - start < std::chrono::seconds(5));
  CHECK(call(server.port(), "POST", "/v1/jobs/" + id + "/cancel", "", "").status == 200);
}

TEST_CASE("what a handler throws stays inside") {
  http::Router router;
  const auto thrower = [](const http::Request&) -> http::Response {
    throw std::runtime_error("a secret\r\nX-Evil: 1");
  };
  router.add({"GET", "/v1/throws", http::Body::none, thrower});
  router.add({"POST", "/v1/throws", http::Body::json, thrower});
  router.add({"GET", "/v1/number", http::Body::none, [](const http::Request&) -> http::Response { throw 1; }});
  http::Guard guard({}, [](const std::string&) { return std::nullopt; });
  metrics::Metrics metrics;
  const http::AccessLog log({});
  http::ListenerSettings settings;
  settings.port = 0;
  http::Listener listener(settings, router, guard, metrics, log);
  const int port = listener.open();
  for (const Reply& reply :
       {call(port, "GET", "/v1/throws"), post(port, "/v1/throws", "{}"), call(port, "GET", "/v1/number"),
        call(port, "GET", "/v1/number", "{}", "Expect: 100-continue\r\n")}) {
    CHECK(reply.status == 500);
    CHECK(reply.headers.at("content-type") == "application/problem+json");
    CHECK(reply.body.find("secret") == std::string::npos);
    for (const auto& [name, value] : reply.headers) {
      CHECK(value.find("secret") == std::string::npos);
      CHECK(name.find("exception") == std::string::npos);
      CHECK(name != "x-evil");
    }
  }
}

TEST_CASE("the slot of a client that left is free soon") {
  http::ServerSettings settings;
  settings.streams.all = 1;
  const TestServer server({}, settings);
  // Nothing happens to a job that waits: only looking after the client can tell.
  const std::string id = server.submit(endless_job(R"(, "progress_interval_s": 3600)"));
  const std::string open = "GET /v1/jobs/" + id + "/events HTTP/1.1\r\nHost: a\r\n\r\n";
  Client first(server.port());
  first.send(open);
  REQUIRE(first.head()->status == 200);
  first.close();
  const auto start = Clock::now();
  CHECK(eventually([&] {
    Client second(server.port());
    second.send(open);
    return second.head() && second.event();
  }));
  CHECK(Clock::now() - start < std::chrono::seconds(5));
}

TEST_CASE("refused connections leave no descriptor open") {
  http::ServerSettings settings;
  settings.listener.max_connections = 2;
  const TestServer server({}, settings);
  Client first(server.port()), second(server.port());
  for (Client* client : {&first, &second}) REQUIRE(client->request("GET", "/healthz")->status == 200);
  const std::size_t before = open_descriptors();
  for (int i = 0; i < 50; ++i) {
    Client refused(server.port());
    CHECK(refused.reply()->status == 503);
  }
  CHECK(eventually([&] { return open_descriptors() <= before; }));
}
