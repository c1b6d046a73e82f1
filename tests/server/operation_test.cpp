#include <doctest/doctest.h>

#include "server/http/assets.h"
#include "server/http/router.h"
#include "tests/server/fixture.h"

using nlohmann::json;

TEST_CASE("health, readiness and metrics") {
  TestServer server;
  const Reply health = call(server.port(), "GET", "/healthz");
  const std::string version = json::parse(call(server.port(), "GET", "/v1/openapi.json").body)["info"]["version"];
  REQUIRE(health.body.starts_with("ok\npenumbra " + version + " (engine "));
  REQUIRE(health.body.ends_with(")\n"));
  const std::string engine = health.body.substr(health.body.size() - 14, 12);
  CHECK(health.headers.at("date").ends_with(" GMT"));
  CHECK(call(server.port(), "GET", "/readyz").status == 200);
  post(server.port(), "/v1/render", small_job());
  const Reply metrics = call(server.port(), "GET", "/metrics");
  CHECK(metrics.headers.at("content-type").starts_with("text/plain; version=0.0.4"));
  CHECK(metrics.body.find("penumbra_jobs_ended_total{state=\"succeeded\"} 1\n") != std::string::npos);
  CHECK(metrics.body.find("penumbra_build_info{engine=\"" + engine + "\",version=\"" + version + "\"} 1\n") !=
        std::string::npos);
  for (const char* request :
       {R"(code="200",method="GET",route="/healthz")", R"(code="200",method="GET",route="/readyz")",
        R"(code="200",method="POST",route="/v1/render")"})
    CHECK(metrics.body.find(std::string("penumbra_http_requests_total{") + request + "} 1\n") != std::string::npos);

  server.manager().stop_accepting();
  CHECK(call(server.port(), "GET", "/healthz").status == 200);
  for (const Reply& reply : {call(server.port(), "GET", "/readyz"), post(server.port(), "/v1/jobs", small_job()),
                             post(server.port(), "/v1/render", small_job())}) {
    CHECK(reply.status == 503);
    CHECK(std::stoi(reply.headers.at("retry-after")) >= 1);
  }
}

TEST_CASE("the contract is served") {
  const TestServer server;
  const Reply openapi = call(server.port(), "GET", "/v1/openapi.json");
  CHECK(openapi.headers.at("content-type") == "application/json");
  CHECK(json::parse(openapi.body).at("openapi").get<std::string>().starts_with("3.1"));
  const Reply schema = call(server.port(), "GET", "/v1/scene.schema.json");
  CHECK(schema.headers.at("content-type") == "application/schema+json");
  CHECK(json::parse(schema.body).contains("$defs"));
  const std::string tag = schema.headers.at("etag");
  CHECK(call(server.port(), "GET", "/v1/scene.schema.json", "", "If-None-Match: " + tag + "\r\n").status == 304);
  CHECK(call(server.port(), "GET", "/v1/scene.schema.json", "", "If-None-Match: \"a\", W/" + tag + "\r\n").status ==
        304);
}

TEST_CASE("every path and method of openapi.json is answered by the server") {
  const TestServer server;
  const json openapi = json::parse(call(server.port(), "GET", "/v1/openapi.json").body);
  for (const auto& [path, item] : openapi.at("paths").items()) {
    if (path == "/") continue;
    std::string target = path;
    if (const std::size_t id = target.find("{id}"); id != std::string::npos) target.replace(id, 4, "x");
    const std::string allowed = call(server.port(), "OPTIONS", target).headers.at("allow");
    for (const char* method : {"get", "post", "delete"}) {
      std::string upper = method;
      for (char& c : upper) c = static_cast<char>(std::toupper(c));
      CHECK_MESSAGE((allowed.find(upper) != std::string::npos) == item.contains(method), upper, " ", path);
    }
  }
}

TEST_CASE("every example scene is listed and is a valid job") {
  const TestServer server;
  for (const json& scene : json::parse(call(server.port(), "GET", "/scenes/index.json").body)) {
    const Reply reply = call(server.port(), "GET", scene.at("path").get<std::string>());
    CHECK(reply.status == 200);
    const Reply valid = post(server.port(), "/v1/jobs?validate_only=true", reply.body);
    CHECK_MESSAGE(valid.status == 200, scene.dump(), " ", valid.body);
  }
}

TEST_CASE("every file is served as what it is; pages are confined to this server") {
  const TestServer server;
  for (const penumbra::http::Asset& asset : penumbra::http::assets()) {
    const Reply reply = call(server.port(), "GET", asset.path);
    CHECK(reply.status == 200);
    CHECK(reply.body == asset.bytes);
    CHECK(reply.headers.at("content-type") == asset.media_type);
    CHECK(reply.headers.at("x-content-type-options") == "nosniff");
    if (asset.media_type.starts_with("text/html"))
      CHECK(reply.headers.at("content-security-policy").starts_with("default-src 'self'"));
  }
  if (penumbra::http::find_asset("/index.html"))
    CHECK(penumbra::http::find_asset("/")->bytes == penumbra::http::find_asset("/index.html")->bytes);
}

TEST_CASE("routes match whole paths and plain ids") {
  using namespace penumbra::http;
  Router router;
  const Handler nothing = [](const Request&) { return Response{}; };
  router.add({"GET", "/a/{id}/b", Body::none, nothing});
  router.add({"GET", "/a", Body::none, nothing});
  CHECK(router.find("GET", "/a/x-1/b").id == "x-1");
  CHECK(router.find("GET", "/a").route != nullptr);
  CHECK(router.find("PUT", "/a").route == nullptr);
  CHECK(router.find("PUT", "/a").allowed == std::vector<std::string>{"GET"});
  for (const char* path : {"/a/", "/a//b", "/a/x/y/b", "/a/x", "/a/x\n/b", "/a/%/b", "/b", ""})
    CHECK(router.find("GET", path).allowed.empty());
  CHECK(router.find("GET", "/a/" + std::string(65, 'x') + "/b").allowed.empty());
}
