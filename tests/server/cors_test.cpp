#include <doctest/doctest.h>

#include "tests/server/fixture.h"

using namespace penumbra;

namespace {

http::ServerSettings open_to(std::vector<std::string> origins) {
  http::ServerSettings settings;
  settings.guard.origins = std::move(origins);
  return settings;
}

constexpr const char* allow_origin = "access-control-allow-origin";

Reply preflight(const TestServer& server, const std::string& origin) {
  return call(server.port(), "OPTIONS", "/v1/jobs", "",
              "Origin: " + origin +
                  "\r\nAccess-Control-Request-Method: POST\r\nAccess-Control-Request-Headers: content-type\r\n");
}

}  // namespace

TEST_CASE("pages of other sites may call when they are on the list") {
  const TestServer server({}, open_to({"https://a.example", "https://b.example:8443"}));
  for (const std::string origin : {"https://a.example", "https://b.example:8443"}) {
    const Reply reply = post(server.port(), "/v1/jobs", small_job(), "Origin: " + origin + "\r\n");
    CHECK(reply.status == 202);
    CHECK(reply.headers.at(allow_origin) == origin);
    CHECK(reply.headers.at("vary") == "Origin");
    CHECK(reply.headers.at("access-control-expose-headers").find("Location") != std::string::npos);
    const Reply asked = preflight(server, origin);
    CHECK(asked.status == 204);
    CHECK(asked.headers.at(allow_origin) == origin);
    CHECK(asked.headers.at("access-control-allow-methods").find("POST") != std::string::npos);
    CHECK(asked.headers.at("access-control-allow-headers").find("Authorization") != std::string::npos);
    CHECK(asked.headers.at("vary") == "Origin");
  }
  for (const std::string origin : {"https://evil.example", "https://a.example.evil.example", "http://a.example", "null",
                                   "*", "https://a.exampl"}) {
    const Reply reply = call(server.port(), "GET", "/v1/jobs", "", "Origin: " + origin + "\r\n");
    CHECK(reply.headers.count(allow_origin) == 0);
    CHECK(reply.headers.at("vary") == "Origin");
    const Reply asked = preflight(server, origin);
    CHECK(asked.headers.count(allow_origin) == 0);
    CHECK(asked.headers.count("access-control-allow-methods") == 0);
  }
  // What differs by origin says so even where there is none.
  CHECK(call(server.port(), "GET", "/v1/jobs").headers.at("vary") == "Origin");
  // Errors are for the page to read too.
  CHECK(post(server.port(), "/v1/jobs", "{}", "Origin: https://a.example\r\n").headers.at(allow_origin) ==
        "https://a.example");
  const Reply large = call(server.port(), "POST", "/v1/jobs", std::string((8u << 20) + 1, ' '),
                           "Origin: https://a.example\r\nX-Request-Id: mine\r\n");
  CHECK(large.status == 413);
  CHECK(large.headers.at(allow_origin) == "https://a.example");
  CHECK(large.headers.at("x-request-id") == "mine");
}

TEST_CASE("without a list no other site may call, with a star every one") {
  const TestServer closed;
  CHECK(preflight(closed, "https://a.example").headers.count(allow_origin) == 0);
  CHECK(call(closed.port(), "GET", "/healthz", "", "Origin: https://a.example\r\n").headers.count("vary") == 0);
  const TestServer open({}, open_to({"*"}));
  CHECK(preflight(open, "https://a.example").headers.at(allow_origin) == "*");
}
