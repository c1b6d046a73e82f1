#include "server/http/encoding.h"

#include <doctest/doctest.h>
#include <libdeflate.h>

#include <memory>

#include "tests/server/fixture.h"

using namespace penumbra;

namespace {

std::string gzip(std::string_view text) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(6), libdeflate_free_compressor);
  std::string bytes(libdeflate_gzip_compress_bound(compressor.get(), text.size()), '\0');
  bytes.resize(libdeflate_gzip_compress(compressor.get(), text.data(), text.size(), bytes.data(), bytes.size()));
  return bytes;
}

std::string gunzip(std::string_view bytes, std::size_t size) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  std::string text(size, '\0');
  REQUIRE(libdeflate_gzip_decompress(decompressor.get(), bytes.data(), bytes.size(), text.data(), size, nullptr) ==
          LIBDEFLATE_SUCCESS);
  return text;
}

constexpr const char* gzip_field = "Content-Encoding: gzip\r\n";

using Inflated = std::variant<std::optional<std::string>, api::Problem>;

int status_of(const Inflated& result) {
  const auto* problem = std::get_if<api::Problem>(&result);
  return problem == nullptr ? 0 : problem->status;
}

std::optional<std::string> text_of(const Inflated& result) { return std::get<std::optional<std::string>>(result); }

bool any_size(std::size_t) { return true; }

}  // namespace

TEST_CASE("bodies may be compressed") {
  const TestServer server;
  const std::string body = another_job();
  const Reply plain = post(server.port(), "/v1/render", body);
  const Reply compressed = post(server.port(), "/v1/render", gzip(body), gzip_field);
  CHECK(compressed.status == 200);
  CHECK(compressed.body == plain.body);
  CHECK(post(server.port(), "/v1/render", body, gzip_field).status == 400);
  CHECK(post(server.port(), "/v1/render", gzip(body).substr(0, 100), gzip_field).status == 400);
  CHECK(post(server.port(), "/v1/render", gzip(body) + "more", gzip_field).status == 400);
  CHECK(post(server.port(), "/v1/render", "", gzip_field).status == 400);
  CHECK(post(server.port(), "/v1/render", gzip("{"), gzip_field).status == 400);
  // What is kept and told of is the body itself.
  const std::string id = server.submit(body);
  CHECK(call(server.port(), "GET", "/v1/jobs/" + id + "/scene").body == body);
}

TEST_CASE("limits hold while a body is inflated") {
  http::ServerSettings settings;
  settings.listener.connection.max_body_bytes = 200'000;
  settings.listener.max_held_body_bytes = 1'000'000;
  const TestServer server({}, settings);
  const std::string job = small_job();
  const auto status_of_size = [&](std::size_t size) {
    return post(server.port(), "/v1/render", gzip(job + std::string(size - job.size(), ' ')), gzip_field).status;
  };
  CHECK(status_of_size(200'000) == 200);
  CHECK(status_of_size(200'001) == 413);
  CHECK(status_of_size(100'000'000) == 413);
}

TEST_CASE("what a body inflates to counts among the large bodies that are held") {
  http::ServerSettings settings;
  settings.listener.max_held_body_bytes = 100'000;
  const TestServer server({}, settings);
  const std::string large = small_job() + std::string(90'000, ' ');
  Client slow(server.port());
  slow.send(
      "POST /v1/jobs HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\nContent-Length: 80000\r\n"
      "Expect: 100-continue\r\n\r\n");
  // Whoever may send has its place.
  REQUIRE(slow.head()->status == 100);
  const Reply refused = post(server.port(), "/v1/render", gzip(large), gzip_field);
  CHECK(refused.status == 503);
  CHECK(std::stoi(refused.headers.at("retry-after")) >= 1);
  slow.close();
  CHECK(eventually([&] { return post(server.port(), "/v1/render", gzip(large), gzip_field).status == 200; }));
}

TEST_CASE("inflating takes no more than it may") {
  const std::string text(100'000, 'a'), small = gzip(text);
  CHECK(text_of(http::inflate(small, text.size(), any_size)) == text);
  CHECK(text_of(http::inflate(small + small, 2 * text.size(), any_size)) == text + text);
  CHECK(text_of(http::inflate(gzip(""), 10, any_size)) == "");
  CHECK(status_of(http::inflate(small, text.size() - 1, any_size)) == 413);
  CHECK(status_of(http::inflate(small + small, 2 * text.size() - 1, any_size)) == 413);
  std::size_t most = 0;
  const auto up_to = [&](std::size_t limit) {
    return [&most, limit](std::size_t bytes) {
      most = std::max(most, bytes);
      return bytes <= limit;
    };
  };
  CHECK(status_of(http::inflate(gzip(std::string(50'000'000, 'a')), 1'000'000, up_to(2'000'000))) == 413);
  CHECK(most == 1'000'000);
  CHECK_FALSE(text_of(http::inflate(gzip(std::string(50'000'000, 'a')), 60'000'000, up_to(2'000'000))));
}

TEST_CASE("text answers of a kilobyte are compressed for who takes that") {
  const TestServer server;
  const Reply plain = call(server.port(), "GET", "/v1/openapi.json");
  CHECK(plain.headers.count("content-encoding") == 0);
  CHECK(plain.headers.at("vary") == "Accept-Encoding");
  const std::string tag = plain.headers.at("etag");
  for (const char* accepted : {"gzip", "br, GZIP;q=0.5", "*", "deflate, gzip;q=1.0, *;q=0", "*;q=0, x-gzip"}) {
    const Reply reply =
        call(server.port(), "GET", "/v1/openapi.json", "", std::string("Accept-Encoding: ") + accepted + "\r\n");
    CAPTURE(accepted);
    CHECK(reply.headers.at("content-encoding") == "gzip");
    CHECK(reply.headers.at("vary") == "Accept-Encoding");
    CHECK(reply.headers.at("etag") == http::gzip_tag(tag));
    CHECK(reply.body.size() < plain.body.size() / 3);
    CHECK(gunzip(reply.body, plain.body.size()) == plain.body);
  }
  for (const char* accepted : {"", "br", "gzip;q=0", "gzip; Q=0.000, *", "identity", "*;q=0", "gzipped"})
    CHECK(call(server.port(), "GET", "/v1/openapi.json", "", std::string("Accept-Encoding: ") + accepted + "\r\n")
              .headers.count("content-encoding") == 0);

  // Either tag tells that the client has it.
  for (const std::string& known : {tag, http::gzip_tag(tag), "W/" + tag, "\"x\", " + tag}) {
    const std::string field = "If-None-Match: " + known + "\r\nAccept-Encoding: gzip\r\n";
    const Reply reply = call(server.port(), "GET", "/v1/openapi.json", "", field);
    CHECK(reply.status == 304);
    CHECK(reply.headers.at("etag") == (known == http::gzip_tag(tag) ? known : tag));
  }
  CHECK(call(server.port(), "GET", "/v1/openapi.json", "", "If-None-Match: \"x\"\r\nIf-None-Match: " + tag + "\r\n")
            .status == 304);
}

TEST_CASE("small answers, images and streams are sent as they are") {
  const TestServer server;
  const std::string accept = "Accept-Encoding: gzip\r\n",
                    id = server.submit(small_job(R"("width": 200, "height": 200)"));
  REQUIRE(server.reaches(id, "succeeded"));
  const std::string job = "/v1/jobs/" + id;
  for (const std::string& path : {std::string("/healthz"), job + "/image", job + "/events"}) {
    Client client(server.port());
    client.send("GET " + path + " HTTP/1.1\r\nHost: a\r\n" + accept + "\r\n");
    CHECK(client.head()->headers.count("content-encoding") == 0);
  }
  const Reply large = post(
      server.port(), "/v1/jobs",
      R"({"scene": {"objects": [)" +
          [] {
            std::string objects = R"({"type": "x"})";
            for (int i = 0; i < 60; ++i) objects += R"(, {"type": "x"})";
            return objects;
          }() +
          "]}}",
      accept);
  CHECK(large.status == 422);
  CHECK(large.headers.at("content-encoding") == "gzip");
}
