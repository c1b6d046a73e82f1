#include "server/http/request_head.h"

#include <doctest/doctest.h>

using penumbra::http::check_head;
using penumbra::http::RequestHead;

namespace {

RequestHead check(const std::string& line, const std::string& fields) {
  return check_head(line + "\r\nHost: a\r\n" + fields + "\r\n", 1000);
}

int refusal(const std::string& line, const std::string& fields = "") {
  const RequestHead checked = check(line, fields);
  return checked.problem ? checked.problem->status : 0;
}

RequestHead accepted(const std::string& line, const std::string& fields = "") {
  RequestHead checked = check(line, fields);
  REQUIRE_FALSE(checked.problem);
  return checked;
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
  CHECK(refusal(post, "Content-Encoding: identity\r\nContent-Length: 5\r\n") == 0);
  CHECK(refusal(post, "Content-Encoding: gzip\r\nContent-Length: 5\r\n") == 415);
  CHECK(refusal(post, "Content-Length : 5\r\n") == 400);
  CHECK(refusal(post, " folded\r\n") == 400);
  CHECK(refusal(post, "no colon\r\n") == 400);
  CHECK(refusal(post, ": nameless\r\n") == 400);
  CHECK(refusal(post, "X: a\nContent-Length: 5\r\n") == 400);
  CHECK(refusal(post, std::string("X: a\0b\r\n", 8)) == 400);
  CHECK(refusal(post, "Host: b\r\n") == 400);
  CHECK(check_head("GET / HTTP/1.1\r\n\r\n", 1000).problem->status == 400);
}

TEST_CASE("the library sees the fields that somebody asks for, and means what the client means") {
  const RequestHead head =
      accepted("GET / HTTP/1.1", "Range: bytes=0-1\r\naccept-encoding: br\r\nConnection: keep-alive\r\nCookie: " +
                                     std::string(9000, 'c') + "\r\nIF-NONE-MATCH: \"b\"\r\n");
  CHECK(head.text == "GET / HTTP/1.1\r\nhost: a\r\nif-none-match: \"b\"\r\n\r\n");
  CHECK(accepted("GET / HTTP/1.1", "Last-Event-ID: 50%2d\r\n").text.find("last-event-id: 50%252d\r\n") !=
        std::string::npos);
  // Longer lines it would refuse without saying why.
  CHECK(refusal("GET / HTTP/1.1", "Authorization: " + std::string(8175, 'a') + "\r\n") == 0);
  CHECK(refusal("GET / HTTP/1.1", "Authorization: " + std::string(8176, 'a') + "\r\n") == 431);
}

TEST_CASE("an Idempotency-Key is one key") {
  const std::string post = "POST / HTTP/1.1", length = "Content-Length: 0\r\n";
  CHECK(refusal(post, length + "Idempotency-Key: a\r\n") == 0);
  CHECK(refusal(post, length + "Idempotency-Key:\r\n") == 400);
  CHECK(refusal(post, length + "Idempotency-Key: a\r\nIdempotency-Key: a\r\n") == 400);
  CHECK(refusal("GET / HTTP/1.1", "Idempotency-Key:\r\n") == 0);
}

TEST_CASE("a refusal tells what was read before it") {
  const RequestHead head =
      check("POST /v1/jobs HTTP/1.1", "Origin: https://a.example\r\nX-Request-Id: 7\r\nTransfer-Encoding: chunked\r\n");
  CHECK(head.problem->status == 411);
  CHECK(head.method == "POST");
  CHECK(head.target == "/v1/jobs");
  CHECK(head.origin == "https://a.example");
  CHECK(head.request_id == "7");
  CHECK(check("BREW / HTTP/1.1", "").method.empty());
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
