// What is decided before a handler is called.
#include <doctest/doctest.h>

#include "api/problems.h"
#include "tests/server/fixture.h"

using nlohmann::json;
using namespace penumbra;

namespace {

/// A server of these routes alone.
class RoutedServer {
 public:
  explicit RoutedServer(std::vector<http::Route> routes, http::GuardSettings guard = {})
      : guard_(std::move(guard), [](const std::string&) { return std::nullopt; }) {
    for (http::Route& route : routes) router_.add(std::move(route));
    http::ListenerSettings settings;
    settings.port = 0;
    listener_ = std::make_unique<http::Listener>(settings, router_, guard_, metrics_, log_);
    port_ = listener_->open();
  }
  int port() const { return port_; }

 private:
  http::Router router_;
  http::Guard guard_;
  metrics::Metrics metrics_;
  const http::AccessLog log_{{}};
  std::unique_ptr<http::Listener> listener_;
  int port_ = 0;
};

/// What has come, in an answer that the document of the interface knows.
http::Response echo(const http::Request& request) {
  return http::problem_response(
      api::not_implemented(request.method + " " + request.id + " " + std::string(request.body)));
}

std::string detail_of(const Reply& reply) { return json::parse(reply.body).at("detail"); }

}  // namespace

TEST_CASE("a route with a body may have any path and any method that has bodies") {
  std::vector<http::Route> routes;
  const std::vector<std::string> methods{"POST", "PUT", "PATCH", "DELETE"},
      paths{"/", "/v1/imports-2/{id}/A_b", "/deep/down/the/tree", "/v1/jobs/{id}"};
  for (const std::string& method : methods) {
    for (const std::string& path : paths) routes.push_back({method, path, http::Body::json, echo});
  }
  const RoutedServer server(std::move(routes));
  for (const std::string& method : methods) {
    for (const std::string path : {"/", "/v1/imports-2/7/A_b", "/deep/down/the/tree", "/v1/jobs/7"}) {
      const Reply reply = call(server.port(), method, path, "{}", "Content-Type: application/json\r\n");
      CAPTURE(method + " " + path);
      CHECK(reply.status == 501);
      CHECK(detail_of(reply) == method + " " + (path.find('7') == std::string::npos ? "" : "7") + " {}");
    }
  }
}

TEST_CASE("parameters that a call does not know are an error, and so is one that is there twice") {
  const TestServer server;
  CHECK(call(server.port(), "GET", "/v1/jobs?limit=1&state=queued").status == 200);
  CHECK(call(server.port(), "GET", "/?utm_source=x&limit=1").status == 200);
  for (const std::string path : {"/v1/jobs?limt=1", "/v1/jobs?limit=1&limit=2", "/v1/jobs?access_token=x", "/v1/jobs?x",
                                 "/healthz?verbose=1", "/v1/openapi.json?x=", "/v1/jobs?%6cimi=1"})
    CHECK_MESSAGE(call(server.port(), "GET", path).status == 400, path);
  CHECK(post(server.port(), "/v1/render?validate_only=true", small_job()).status == 400);
  CHECK(detail_of(call(server.port(), "GET", "/v1/jobs?page-token=1")).find("\"page_token\"") != std::string::npos);
}

TEST_CASE("a server that knows its hosts answers for no other") {
  http::ServerSettings settings;
  settings.guard.hosts = http::KnownHosts({"render.example.org"}, false);
  const TestServer server({}, settings);
  const auto status_for = [&](const std::string& host, const std::string& line = "GET /healthz HTTP/1.1") {
    Client client(server.port());
    client.send(line + "\r\nHost: " + host + "\r\n\r\n");
    return client.reply()->status;
  };
  for (const char* host :
       {"127.0.0.1", "localhost:8080", "LOCALHOST", "[::1]:1", "render.example.org", "Render.Example.org:443"})
    CHECK_MESSAGE(status_for(host) == 200, host);
  for (const char* host : {"evil.example", "example.org", "10.0.0.1", "[::2]", "127.0.0.1.evil.example"})
    CHECK_MESSAGE(status_for(host) == 421, host);
  CHECK(status_for("127.0.0.1", "GET http://evil.example/healthz HTTP/1.1") == 421);
  CHECK(status_for("evil.example", "GET http://127.0.0.1/healthz HTTP/1.1") == 200);
  CHECK(status_for("evil.example", "OPTIONS * HTTP/1.1") == 421);
  Client old(server.port());
  old.send("GET /healthz HTTP/1.0\r\n\r\n");
  CHECK(old.reply()->status == 200);
}

TEST_CASE("an answer of no length ends its connection, also to HEAD") {
  const TestServer server;
  const std::string id = server.submit(endless_job());
  Client client(server.port());
  client.send("HEAD /v1/jobs/" + id + "/events HTTP/1.1\r\nHost: a\r\n\r\n");
  CHECK(client.head()->headers.at("connection") == "close");
  CHECK(client.is_closed_by_server());
}
