#include <doctest/doctest.h>

#include <chrono>
#include <sstream>
#include <thread>

#include "tests/server/fixture.h"

using nlohmann::json;
using Clock = std::chrono::steady_clock;

namespace {

penumbra::http::ServerSettings impatient() {
  penumbra::http::ServerSettings settings;
  settings.listener.connection.request = std::chrono::milliseconds(300);
  settings.listener.connection.max_body_bytes = 10'000;
  return settings;
}

/// The status of the answer to these bytes, after which the connection must end.
int refused_with(const TestServer& server, const std::string& bytes) {
  Client client(server.port());
  client.send(bytes);
  const auto reply = client.reply();
  if (!reply) return 0;
  CHECK(reply->headers.at("content-type") == "application/problem+json");
  CHECK(reply->reason.size() > 1);
  CHECK(reply->headers.at("connection") == "close");
  CHECK(json::parse(reply->body).at("status") == reply->status);
  CHECK(client.is_closed_by_server());
  return reply->status;
}

std::string post_head(const std::string& fields) {
  return "POST /v1/jobs HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\n" + fields + "\r\n";
}

}  // namespace

TEST_CASE("requests that cannot be framed are refused at once") {
  const TestServer server;
  CHECK(refused_with(server, post_head("")) == 411);
  CHECK(refused_with(server, post_head("Transfer-Encoding: chunked\r\n") + "5\r\nhello\r\n0\r\n\r\n") == 411);
  // A job that would be taken.
  const std::string job = small_job();
  std::ostringstream chunks;
  chunks << std::hex << job.size() << "\r\n" << job << "\r\n0\r\n\r\n";
  const std::string length = "Content-Length: " + std::to_string(chunks.str().size()) + "\r\n";
  CHECK(refused_with(server, post_head("Transfer-Encoding: chunked\r\n" + length) + chunks.str()) == 400);
  CHECK(refused_with(server, post_head("Content-Length: 5\r\nContent-Length: 6\r\n") + "hello") == 400);
  CHECK(refused_with(server, post_head("Content-Encoding: br\r\nContent-Length: 5\r\n") + "hello") == 415);
  CHECK(refused_with(server, "GET / HTTP/1.1\r\n\r\n") == 400);
  CHECK(refused_with(server, "nonsense\r\n\r\n") == 400);
  CHECK(refused_with(server, "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n") == 505);
  CHECK(refused_with(server, "GET /" + std::string(300, 'a') + " HTTP/1.1\r\nHost: a\r\n\r\n") == 414);
}

TEST_CASE("bodies of other types are not read") {
  const TestServer server;
  const std::string length = "Content-Length: 5\r\n\r\nhello";
  const std::string start = "POST /v1/render HTTP/1.1\r\nHost: a\r\n";
  CHECK(refused_with(server, start + length) == 415);
  for (const char* type : {"text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x",
                           "application/json; charset=latin1", "application/jsonp"})
    CHECK(refused_with(server, start + "Content-Type: " + type + "\r\n" + length) == 415);
  CHECK(refused_with(server, start + "Content-Type: text/plain\r\nExpect: 100-continue\r\n" + length) == 415);
}

TEST_CASE("of the type's parameters the charset counts") {
  const TestServer server;
  const std::string body = small_job();
  for (const char* parameters : {"", ";", "; charset=UTF-8;", ";charset=\"utf-8\"; profile=x", "; profile=x"}) {
    CAPTURE(parameters);
    Client client(server.port());
    client.send(std::string("POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Type: application/json") + parameters +
                "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
    CHECK(client.reply()->status == 200);
  }
}

TEST_CASE("who asks for leave to send a body gets it, or the refusal") {
  const TestServer server;
  const std::string body = small_job(), length = "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n";
  const std::string type = "Host: a\r\nContent-Type: application/json\r\n";
  for (const char* field : {"Expect: 100-continue\r\n", "EXPECT: 100-Continue\r\n"}) {
    Client client(server.port());
    client.send("POST /v1/render HTTP/1.1\r\n" + type + field + length);
    CHECK(client.head()->status == 100);
    client.send(body);
    CHECK(client.reply()->status == 200);
  }
  // The first answer is the last where the body is not wanted, and where interim ones are not known.
  for (const char* line : {"POST /nothing", "PUT /v1/render", "POST /v1/render?unknown=1"}) {
    Client client(server.port());
    client.send(std::string(line) + " HTTP/1.1\r\n" + type + "Expect: 100-continue\r\n" + length);
    CHECK(client.reply()->status >= 400);
    CHECK(client.is_closed_by_server());
  }
  Client old(server.port());
  old.send("POST /v1/render HTTP/1.0\r\n" + type + "Expect: 100-continue\r\n" + length);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  old.send(body);
  CHECK(old.reply()->status == 200);
}

TEST_CASE("what is no HTTP is told so at once") {
  const TestServer server;
  const auto start = Clock::now();
  CHECK(refused_with(server, std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11)) == 400);  // TLS
  CHECK(refused_with(server, "\x80garbage") == 400);
  CHECK(refused_with(server, std::string(40, 'a')) == 400);
  CHECK(Clock::now() - start < std::chrono::seconds(3));
}

TEST_CASE("who has closed only the way to the server gets the answer all the same") {
  const TestServer server;
  const auto answer_to = [&](const std::string& request) {
    Client client(server.port());
    client.send(request);
    client.finish_sending();
    return client.reply();
  };
  const std::string body = another_job();
  const auto rendered =
      answer_to("POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\nContent-Length: " +
                std::to_string(body.size()) + "\r\n\r\n" + body);
  REQUIRE(rendered);
  CHECK(rendered->status == 200);
  const std::string image = rendered->headers.at("content-location");
  const auto again = answer_to("GET " + image + " HTTP/1.1\r\nHost: a\r\n\r\n");
  REQUIRE(again);
  CHECK(again->body == rendered->body);
}

TEST_CASE("header fields have a budget") {
  const TestServer server;
  std::string many = "GET /healthz HTTP/1.1\r\nHost: a\r\n";
  for (int i = 0; i < 20'000; ++i) many += "X-" + std::to_string(i) + ": y\r\n";
  CHECK(refused_with(server, many + "\r\n") == 431);
  CHECK(refused_with(server, "GET /healthz HTTP/1.1\r\nHost: a\r\nX: " + std::string(100'000, 'y') + "\r\n\r\n") ==
        431);
  CHECK(call(server.port(), "GET", "/healthz", "", "Cookie: " + std::string(60'000, 'y') + "\r\n").status == 200);
  CHECK(call(server.port(), "GET", "/healthz", "", "Authorization: " + std::string(9000, 'y') + "\r\n").status == 200);
}

TEST_CASE("bodies have a limit, said before they are sent") {
  const TestServer server({}, impatient());
  CHECK(refused_with(server, post_head("Content-Length: 10001\r\n")) == 413);
  CHECK(refused_with(server, post_head("Content-Length: 10001\r\n") + std::string(10'001, ' ')) == 413);
  CHECK(refused_with(server, post_head("Content-Length: 18446744073709551615\r\n")) == 413);
  // Larger than what the sockets buffer: the client must be able to send it all and then read why not.
  CHECK(refused_with(server, post_head("Content-Length: 20000000\r\n") + std::string(20'000'000, ' ')) == 413);
}

TEST_CASE("slow senders are cut, wherever they stop") {
  const TestServer server({}, impatient());
  const auto start = Clock::now();
  CHECK(refused_with(server, "GET /healthz HTT") == 408);
  CHECK(refused_with(server, "GET /healthz HTTP/1.1\r\nHost: a\r\n") == 408);
  CHECK(refused_with(server, post_head("Content-Length: 100\r\n") + "{") == 400);
  CHECK(Clock::now() - start < std::chrono::seconds(10));

  // A byte now and then does not help.
  Client dripping(server.port());
  int sent = 0;
  dripping.send("GET /healthz HTTP/1.1\r\nX: ");
  while (dripping.send("y") && ++sent < 10'000) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  CHECK(sent < 2000);
}

TEST_CASE("idle connections are closed") {
  penumbra::http::ServerSettings settings;
  settings.listener.connection.idle = std::chrono::milliseconds(100);
  const TestServer server({}, settings);
  Client silent(server.port());
  CHECK(silent.is_closed_by_server());
  Client kept(server.port());
  CHECK(kept.request("GET", "/healthz")->status == 200);
  CHECK(kept.is_closed_by_server());
}

TEST_CASE("pipelined requests are answered in order; what follows garbage is not") {
  const TestServer server;
  const std::string get = "GET /healthz HTTP/1.1\r\nHost: a\r\n\r\n";
  Client client(server.port());
  client.send(get + "\r\n" + get + "\x01garbage\r\n\r\n" + get);
  CHECK(client.reply()->status == 200);
  CHECK(client.reply()->status == 200);
  CHECK(client.reply()->status == 400);
  CHECK(client.is_closed_by_server());
}

TEST_CASE("a body that nobody reads is never taken for a request") {
  const TestServer server;
  const std::string inner = "GET /healthz HTTP/1.1\r\nHost: a\r\n\r\n";
  const std::string length = "Content-Length: " + std::to_string(inner.size()) + "\r\n\r\n";
  for (const char* line : {"GET /healthz", "POST /nothing", "PUT /v1/jobs", "POST /v1/jobs/a/cancel",
                           "DELETE /v1/jobs/a", "POST /v1/jobs"}) {
    Client client(server.port());
    client.send(std::string(line) + " HTTP/1.1\r\nHost: a\r\n" + length + inner);
    const auto reply = client.reply();
    REQUIRE(reply);
    CHECK(reply->headers.at("connection") == "close");
    CHECK(client.is_closed_by_server());
  }
}

TEST_CASE("too many connections are answered, not left waiting") {
  penumbra::http::ServerSettings settings;
  settings.listener.max_connections = 3;
  const TestServer server({}, settings);
  Client a(server.port()), b(server.port()), c(server.port());
  for (Client* client : {&a, &b, &c}) REQUIRE(client->request("GET", "/healthz")->status == 200);
  Client d(server.port());
  const auto reply = d.reply();
  REQUIRE(reply);
  CHECK(reply->status == 503);
  CHECK(std::stoi(reply->headers.at("retry-after")) >= 1);
  a.close();
  CHECK(eventually([&] {
    Client e(server.port());
    const auto again = e.request("GET", "/healthz");
    return again && again->status == 200;
  }));
}

TEST_CASE("large bodies that are not answered have a budget") {
  penumbra::http::ServerSettings settings;
  settings.listener.max_held_body_bytes = 200'000;
  const TestServer server({}, settings);
  const std::string large = small_job() + std::string(150'000, ' ');
  const std::string head =
      "POST /v1/jobs HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\nX-Request-Id: r1\r\n";
  Client slow(server.port());
  slow.send(head + "Content-Length: 150000\r\nExpect: 100-continue\r\n\r\n");
  // Whoever may send has its place.
  REQUIRE(slow.head()->status == 100);
  const Reply refused = post(server.port(), "/v1/render", large, "X-Request-Id: r2\r\n");
  CHECK(refused.status == 503);
  CHECK(post(server.port(), "/v1/render", small_job()).status == 200);
  CHECK(std::stoi(refused.headers.at("retry-after")) >= 1);
  CHECK(refused.headers.at("x-request-id") == "r2");
  slow.close();
  CHECK(eventually([&] { return post(server.port(), "/v1/render", large).status == 200; }));
}

TEST_CASE("old clients and last requests") {
  const TestServer server;
  Client old(server.port());
  old.send("GET /healthz HTTP/1.0\r\n\r\n");
  CHECK(old.reply()->body.starts_with("ok\n"));
  CHECK(old.is_closed_by_server());
  Client last(server.port());
  CHECK(last.request("GET", "/healthz", "", "Connection: close\r\n")->headers.at("connection") == "close");
  CHECK(last.is_closed_by_server());
}
