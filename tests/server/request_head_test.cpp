#include "server/http/request_head.h"

#include <doctest/doctest.h>

using penumbra::api::Problem;
using penumbra::http::check_head;
using penumbra::http::RequestHead;

namespace {

std::variant<RequestHead, Problem> check(const std::string& line, const std::string& fields) {
  return check_head(line + "\r\nHost: a\r\n" + fields + "\r\n", 1000);
}

int refusal(const std::string& line, const std::string& fields = "") {
  const auto checked = check(line, fields);
  return std::holds_alternative<Problem>(checked) ? std::get<Problem>(checked).status : 0;
}

RequestHead accepted(const std::string& line, const std::string& fields = "") {
  return std::get<RequestHead>(check(line, fields));
}

}  // namespace

TEST_CASE("request lines") {
  CHECK(refusal("GET / HTTP/1.1") == 0);
  CHECK(refusal("OPTIONS * HTTP/1.1") == 0);
  CHECK(refusal("GET http://example.org/a?b HTTP/1.1") == 0);
  CHECK(accepted("GET http://example.org/a?b HTTP/1.1").text.starts_with("GET /a?b HTTP/1.1\r\n"));
  CHECK(accepted("GET http://example.org HTTP/1.1").text.starts_with("GET / HTTP/1.1\r\n"));
  CHECK(refusal("") == 400);
  CHECK(refusal("GET /") == 400);
  CHECK(refusal("GET / x HTTP/1.1") == 400);
  CHECK(refusal("GET /a\tb HTTP/1.1") == 400);
  CHECK(refusal("GET a HTTP/1.1") == 400);
  CHECK(refusal("G T / HTTP/1.1") == 400);
  CHECK(refusal("\x16\x03\x01 / HTTP/1.1") == 400);
  CHECK(refusal("BREW / HTTP/1.1") == 501);
  CHECK(refusal("GET / HTTP/2.0") == 505);
  CHECK(refusal("GET /" + std::string(199, 'a') + " HTTP/1.1") == 0);
  CHECK(refusal("GET /" + std::string(200, 'a') + " HTTP/1.1") == 414);
  CHECK(refusal("GET /?" + std::string(2000, 'a') + " HTTP/1.1") == 0);
  CHECK(refusal("GET /?" + std::string(3000, 'a') + " HTTP/1.1") == 414);
}

TEST_CASE("fields that two readers could understand differently") {
  const std::string post = "POST / HTTP/1.1";
  CHECK(refusal(post, "Content-Length: 5\r\n") == 0);
  CHECK(accepted(post, "Content-Length:  5 \r\n").body_bytes == 5);
  CHECK(refusal(post, "Content-Length: 5\r\nContent-Length: 5\r\n") == 400);
  CHECK(refusal(post, "Content-Length: +5\r\n") == 400);
  CHECK(refusal(post, "Content-Length: 0x5\r\n") == 400);
  CHECK(refusal(post, "Content-Length: 5, 5\r\n") == 400);
  CHECK(refusal(post, "Content-Length: -1\r\n") == 400);
  CHECK(refusal(post, "Content-Length:\r\n") == 400);
  CHECK(refusal(post, "Content-Length: 99999999999999999999999\r\n") == 400);
  CHECK(refusal(post, "Content-Length: 1001\r\n") == 413);
  CHECK(refusal(post, "Transfer-Encoding: chunked\r\n") == 411);
  CHECK(refusal(post, "Transfer-Encoding: chunked\r\nContent-Length: 5\r\n") == 400);
  CHECK(refusal(post, "Content-Encoding: gzip\r\nContent-Length: 5\r\n") == 415);
  CHECK(refusal(post, "Content-Length : 5\r\n") == 400);
  CHECK(refusal(post, " folded\r\n") == 400);
  CHECK(refusal(post, "no colon\r\n") == 400);
  CHECK(refusal(post, ": nameless\r\n") == 400);
  CHECK(refusal(post, "X: a\nContent-Length: 5\r\n") == 400);
  CHECK(refusal(post, std::string("X: a\0b\r\n", 8)) == 400);
  CHECK(refusal(post, "Host: b\r\n") == 400);
  CHECK(std::get<Problem>(check_head("GET / HTTP/1.1\r\n\r\n", 1000)).status == 400);
}

TEST_CASE("what the library must not act upon is taken out") {
  const RequestHead head =
      accepted("GET / HTTP/1.1", "Range: bytes=0-1\r\naccept-encoding: br\r\nConnection: keep-alive\r\nX-A: b\r\n");
  CHECK(head.text == "GET / HTTP/1.1\r\nHost: a\r\nX-A: b\r\n\r\n");
}

TEST_CASE("which request is the last of its connection") {
  CHECK_FALSE(accepted("GET / HTTP/1.1").is_last);
  CHECK(accepted("GET / HTTP/1.1", "Connection: Close\r\n").is_last);
  CHECK(accepted("GET / HTTP/1.1", "Connection: te, close\r\n").is_last);
  CHECK(accepted("GET / HTTP/1.0").is_last);
  CHECK_FALSE(accepted("GET / HTTP/1.0", "Connection: Keep-Alive\r\n").is_last);
  CHECK(accepted("POST / HTTP/1.1").is_last);  // a body may follow, and nobody knows how long
  CHECK_FALSE(accepted("POST / HTTP/1.1", "Content-Length: 0\r\n").is_last);
}
