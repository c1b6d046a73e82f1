#include "server/http/request_head.h"

#include <doctest/doctest.h>

#include "server/http/host.h"

using namespace penumbra::http;

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
  CHECK_FALSE(accepted(post, "Content-Encoding: Identity\r\nContent-Length: 5\r\n").is_body_gzip);
  CHECK(accepted(post, "Content-Encoding: GZIP\r\nContent-Length: 5\r\n").is_body_gzip);
  CHECK(refusal(post, "Content-Encoding: br\r\nContent-Length: 5\r\n") == 415);
  CHECK(refusal(post, "Content-Encoding: gzip, gzip\r\nContent-Length: 5\r\n") == 415);
  CHECK(refusal(post, "Content-Length : 5\r\n") == 400);
  CHECK(refusal(post, " folded\r\n") == 400);
  CHECK(refusal(post, "no colon\r\n") == 400);
  CHECK(refusal(post, ": nameless\r\n") == 400);
  CHECK(refusal(post, "X: a\rContent-Length: 5\r\n") == 400);
  CHECK(refusal(post, std::string("X: a\0b\r\n", 8)) == 400);
  CHECK(refusal(post, "Host: b\r\n") == 400);
  CHECK(check_head("GET / HTTP/1.1\r\n\r\n", 1000).problem->status == 400);
}

TEST_CASE("the library sees what it needs, and every field that is known can be asked for") {
  const RequestHead head =
      accepted("POST / HTTP/1.1", "Range: bytes=0-1\r\naccept-encoding: br\r\nConnection: keep-alive\r\nCookie: " +
                                      std::string(9000, 'c') + "\r\nIF-NONE-MATCH: \"b\"\r\ncontent-length: 05\r\n");
  CHECK(head.text == "POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\n");
  CHECK(head.fields[Field::if_none_match] == "\"b\"");
  CHECK(head.fields[Field::accept_encoding] == "br");
  CHECK_FALSE(head.fields[Field::authorization]);
}

TEST_CASE("lines of one name are a list where there are lists, else an error or nothing") {
  const std::string get = "GET / HTTP/1.1";
  CHECK(accepted(get, "If-None-Match: \"a\"\r\nif-none-match: \"b\"\r\n").fields[Field::if_none_match] ==
        "\"a\", \"b\"");
  CHECK(accepted(get, "Connection: te\r\nConnection: close\r\n").is_last);
  for (const std::string name : {"Authorization", "Content-Type", "Idempotency-Key", "Host", "Content-Length"})
    CHECK(refusal(get, name + ": 1\r\n" + name + ": 1\r\n") == 400);
  for (const Field field : {Field::x_request_id, Field::traceparent, Field::origin, Field::last_event_id}) {
    const std::string name(field_rules[static_cast<std::size_t>(field)].name);
    CHECK(accepted(get, name + ": 1\r\n").fields[field] == "1");
    CHECK_FALSE(accepted(get, name + ": 1\r\n" + name + ": 1\r\n" + name + ": 1\r\n").fields[field]);
  }
}

TEST_CASE("members of a list, not letters, are compared") {
  CHECK(has_member("a, b", "b"));
  CHECK(has_member(" ,, CLOSE ,", "close"));
  CHECK_FALSE(has_member("x-close, closed", "close"));
  CHECK_FALSE(has_member("\"a, close\"", "close"));
  CHECK_FALSE(has_member("", "close"));
  CHECK_FALSE(accepted("GET / HTTP/1.1", "Connection: x-close\r\n").is_last);
}

TEST_CASE("hosts") {
  for (const auto& [written, host] :
       std::vector<std::pair<std::string, std::string>>{{"a", "a"},
                                                        {"Example.ORG:8080", "example.org"},
                                                        {"127.0.0.1:1", "127.0.0.1"},
                                                        {"[::1]:80", "::1"},
                                                        {"a:", "a"}})
    CHECK_MESSAGE(host_in(written) == host, written);
  for (const char* written : {"", ":80", "a b", "a/b", "a:b", "a:123456", "user@a", "[::1", "[a]", "::1", "a,b:1:1"})
    CHECK_MESSAGE(!host_in(written), written);
  for (const char* host : {"localhost", "page.localhost", "127.0.0.1", "127.255.0.9", "::1"}) CHECK(is_loopback(host));
  for (const char* host : {"", "0.0.0.0", "128.0.0.1", "::2", "localhost.example.org", "127.0.0.1.example.org"})
    CHECK_FALSE(is_loopback(host));
  for (const bool is_public : {false, true}) {
    const KnownHosts hosts({"example.org"}, is_public);
    CHECK(hosts.has("example.org"));
    CHECK(hosts.has("::1"));
    CHECK_FALSE(hosts.has("www.example.org"));
    CHECK_FALSE(hosts.has("1.2.3.4.example"));
    CHECK(hosts.has("192.168.1.2") == is_public);
    CHECK(hosts.has("fe80::1") == is_public);
  }

  CHECK(check_head("GET / HTTP/1.1\r\nHost: a b\r\n\r\n", 1000).problem->status == 400);
  CHECK(check_head("GET / HTTP/1.1\r\nHost:\r\n\r\n", 1000).problem->status == 400);
  CHECK(accepted("GET http://[::1]:8080/a HTTP/1.1").host == "::1");
  CHECK(accepted("GET HTTPS://B.example?q HTTP/1.1").host == "b.example");
  CHECK(accepted("GET HTTPS://B.example?q HTTP/1.1").target == "/?q");
  CHECK(refusal("GET http:/// HTTP/1.1") == 400);
  CHECK(refusal("GET ftp://a/ HTTP/1.1") == 400);
  CHECK(check_head("GET / HTTP/1.0\r\n\r\n", 1000).host.empty());
}

TEST_CASE("lines may end with LF alone") {
  const std::string head = "GET /a HTTP/1.1\nHost: a\nX-Request-Id: 7\n\n";
  CHECK(end_of_head(head + "more", 0) == head.size());
  CHECK(end_of_head("GET / HTTP/1.1\nHost: a\n\r\nmore", 0) == 25);
  CHECK(end_of_head("GET / HTTP/1.1\r\nHost: a\r\n", 0) == std::string::npos);
  CHECK(check_head(head, 1000).target == "/a");
  CHECK(check_head(head, 1000).fields[Field::x_request_id] == "7");
  CHECK(check_head("GET /a HTTP/1.1\rHost: a\r\n\r\n", 1000).problem->status == 400);
}

TEST_CASE("what asks for leave to send a body") {
  const auto is_asked = [](const std::string& line, const std::string& fields) {
    return accepted(line, fields).text.find("Expect: 100-continue\r\n") != std::string::npos;
  };
  const std::string post = "POST / HTTP/1.1", length = "Content-Length: 5\r\n";
  CHECK(is_asked(post, length + "Expect: 100-continue\r\n"));
  CHECK(is_asked(post, length + "EXPECT:100-Continue\r\n"));
  CHECK_FALSE(is_asked("POST / HTTP/1.0", length + "Expect: 100-continue\r\n"));
  CHECK_FALSE(is_asked(post, "Content-Length: 0\r\nExpect: 100-continue\r\n"));
  CHECK_FALSE(is_asked(post, length + "Expect: tea\r\n"));
}

TEST_CASE("an Idempotency-Key is one key") {
  CHECK(refusal("POST / HTTP/1.1", "Content-Length: 0\r\nIdempotency-Key: a\r\n") == 0);
  CHECK(refusal("POST / HTTP/1.1", "Content-Length: 0\r\nIdempotency-Key: a\r\nIdempotency-Key: a\r\n") == 400);
}

TEST_CASE("a refusal tells what was read before it") {
  const RequestHead head =
      check("POST /v1/jobs HTTP/1.1", "Origin: https://a.example\r\nX-Request-Id: 7\r\nTransfer-Encoding: chunked\r\n");
  CHECK(head.problem->status == 411);
  CHECK(head.method == "POST");
  CHECK(head.target == "/v1/jobs");
  CHECK(head.fields[Field::origin] == "https://a.example");
  CHECK(head.fields[Field::x_request_id] == "7");
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
