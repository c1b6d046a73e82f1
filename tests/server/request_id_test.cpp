#include <doctest/doctest.h>

#include "server/http/request_ids.h"
#include "server/log/log.h"
#include "tests/server/fixture.h"

using namespace penumbra;
using namespace penumbra::http;

TEST_CASE("a sane request id is taken over, any other replaced") {
  const TestServer server;
  const auto answered = [&](const std::string& header) {
    return call(server.port(), "GET", "/healthz", "", header).headers.at("x-request-id");
  };
  CHECK(answered("X-Request-Id: abc-1.2_3:4\r\n") == "abc-1.2_3:4");
  const std::string made = answered("");
  CHECK(made.size() == 32);
  CHECK(made != answered(""));
  for (const std::string& bad : {std::string("a b"), std::string(129, 'a'), std::string(""), std::string("a\"b"),
                                 std::string("a\xc3\xa4"), std::string("<a>"), std::string("a,b")})
    CHECK(answered("X-Request-Id: " + bad + "\r\n").size() == 32);
  CHECK(answered("X-Request-Id: a\r\nX-Request-Id: b\r\n").size() == 32);
  // Refusals have one too, and so does what the library answers by itself.
  for (const char* request :
       {"nonsense\r\n\r\n", "GET /nothing HTTP/1.1\r\nHost: a\r\n\r\n", "POST /v1/jobs HTTP/1.1\r\nHost: a\r\n\r\n"}) {
    Client client(server.port());
    client.send(request);
    CHECK(client.reply()->headers.at("x-request-id").size() == 32);
  }
}

TEST_CASE("traceparent is read as W3C Trace Context has it") {
  const std::string trace = "4bf92f3577b34da6a3ce929d0e0e4736", parent = "00f067aa0ba902b7";
  const std::string good = "00-" + trace + "-" + parent + "-01";
  CHECK(parse_traceparent(good) == TraceParent{trace, parent, true});
  CHECK(parse_traceparent("00-" + trace + "-" + parent + "-00")->is_sampled == false);
  CHECK(parse_traceparent("00-" + trace + "-" + parent + "-ff")->is_sampled);
  CHECK(parse_traceparent("cc-" + trace + "-" + parent + "-01-what-the-future-will-be-like"));
  CHECK(parse_traceparent("cc-" + trace + "-" + parent + "-01"));
  for (const std::string& bad :
       {std::string(), good + "-x", good + "x", "ff" + good.substr(2), "cc" + good.substr(2) + ".what",
        "00-" + std::string(32, '0') + "-" + parent + "-01", "00-" + trace + "-" + std::string(16, '0') + "-01",
        "00-4BF92F3577B34DA6A3CE929D0E0E4736-" + parent + "-01", "00-" + trace + "-" + parent + "-0g",
        "00-" + trace + "-" + parent + "-1", "0-" + trace + "-" + parent + "-01", "00_" + trace + "-" + parent + "-01",
        "00-" + trace + "_" + parent + "-01", "00-" + trace + "-" + parent + "_01", " " + good})
    CHECK_MESSAGE(!parse_traceparent(bad), bad);
}

TEST_CASE("what goes into the log is one line of JSON, whatever clients send") {
  CHECK(log::quoted("a\"b\\c\n\r\t\x1b[31m\x7f") == "\"a\\\"b\\\\c\\u000a\\u000d\\u0009\\u001b[31m\\u007f\"");
  CHECK(log::quoted("ä€😀") == "\"ä€😀\"");
  for (const char* bad : {"\xff", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\x80", "\xe2\x82"}) {
    const std::string quoted = log::quoted(std::string("a") + bad + "b");
    CHECK(nlohmann::json::parse(quoted).get<std::string>().find("\xef\xbf\xbd") == 1);
  }
  std::string every;
  for (int i = 0; i < 256; ++i) every += static_cast<char>(i);
  CHECK_NOTHROW(nlohmann::json::parse(log::quoted(every)));
}
