#include <doctest/doctest.h>

#include <chrono>

#include "server/access/key_ring.h"
#include "tests/server/fixture.h"

using nlohmann::json;
using namespace penumbra;
using access::Scope;

namespace {

/// A server that asks for keys, and one key of each kind.
class KeyedServer {
 public:
  explicit KeyedServer(http::ServerSettings settings = {}, const jobs::Settings& jobs = {})
      : ring_(write()), server_(jobs, with_keys(std::move(settings))) {}

  std::string as(const access::NewKey& key) const { return "Authorization: Bearer " + key.text + "\r\n"; }
  Reply get(const std::string& path, const std::string& headers = "") const {
    return call(server_.port(), "GET", path, "", headers);
  }
  Reply submit(const access::NewKey& key, const std::string& body = small_job(), const std::string& more = "") const {
    return post(server_.port(), "/v1/jobs", body, as(key) + more);
  }
  static std::string id_in(const Reply& reply) { return json::parse(reply.body).at("id"); }
  int port() const { return server_.port(); }
  const TestServer& server() const { return server_; }

  const access::NewKey alice = access::make_key("alice", {Scope::read, Scope::write}),
                       bob = access::make_key("bob", {Scope::read, Scope::write}),
                       reader = access::make_key("alice", {Scope::read}),
                       scraper = access::make_key("watch", {Scope::metrics}),
                       admin = access::make_key("root", {Scope::admin});

  /// How many this key sees.
  std::size_t jobs_of(const access::NewKey& key) const {
    return json::parse(get("/v1/jobs", as(key)).body).at("jobs").size();
  }
  void revoke_alice() const { write_all_but(&alice); }

 private:
  std::string write() const { return write_all_but(nullptr); }
  std::string write_all_but(const access::NewKey* revoked) const {
    std::string text;
    for (const auto* key : {&alice, &bob, &reader, &scraper, &admin})
      if (key != revoked) text += access::line_of(key->key) + "\n";
    access::write_keys(folder_ / "keys", text);
    return folder_ / "keys";
  }
  http::ServerSettings with_keys(http::ServerSettings settings) const {
    settings.guard.keys = &ring_;
    return settings;
  }

  const test::TemporaryDirectory folder_;
  access::KeyRing ring_;
  TestServer server_;
};

const std::vector<std::pair<std::string, std::string>> calls_of_a_job{
    {"GET", ""},           {"GET", "/events"}, {"GET", "/image"},   {"GET", "/preview"},
    {"GET", "/thumbnail"}, {"GET", "/scene"},  {"POST", "/cancel"}, {"DELETE", ""}};

}  // namespace

TEST_CASE("without a key, or with one that is not known, every call of jobs is a 401 that says how") {
  const KeyedServer server;
  std::vector<std::pair<std::string, std::string>> calls{
      {"POST", "/v1/jobs"}, {"GET", "/v1/jobs"}, {"POST", "/v1/render"}, {"GET", "/metrics"}};
  for (const auto& [method, rest] : calls_of_a_job) calls.emplace_back(method, "/v1/jobs/x" + rest);
  for (const auto& [method, path] : calls) {
    const Reply none = call(server.port(), method, path);
    CHECK_MESSAGE(none.status == 401, method, " ", path);
    CHECK(none.headers.at("www-authenticate") == "Bearer realm=\"penumbra\"");
    for (const std::string& wrong :
         {"Bearer " + access::make_key("alice", {Scope::admin}).text, std::string("Bearer nonsense"),
          "Bearer " + server.alice.text + "x", "Bearer " + server.alice.text.substr(1)}) {
      const Reply reply = call(server.port(), method, path, "", "Authorization: " + wrong + "\r\n");
      CHECK(reply.status == 401);
      CHECK(reply.headers.at("www-authenticate").ends_with("error=\"invalid_token\""));
      CHECK(reply.body.find(server.alice.text) == std::string::npos);
    }
    CHECK(call(server.port(), method, path, "", "Authorization: Bearer \r\n").status == 401);
    CHECK(call(server.port(), method, path, "", "Authorization: Basic " + server.alice.text + "\r\n").status == 401);
  }
  for (const char* path : {"/", "/healthz", "/readyz", "/v1/openapi.json", "/v1/scene.schema.json"})
    CHECK(server.get(path).status == 200);
}

TEST_CASE("who has a key may do what its scopes say") {
  const KeyedServer server;
  const std::string id = server.id_in(server.submit(server.alice));
  CHECK(server.get("/v1/jobs/" + id, server.as(server.alice)).status == 200);
  CHECK(server.get("/v1/jobs/" + id, "authorization: bearer   " + server.alice.text + "\r\n").status == 200);
  CHECK(server.get("/v1/jobs/" + id, server.as(server.reader)).status == 200);
  const Reply submitted = server.submit(server.reader);
  CHECK(submitted.status == 403);
  CHECK(submitted.headers.at("www-authenticate").find("scope=\"jobs:write\"") != std::string::npos);
  CHECK(call(server.port(), "DELETE", "/v1/jobs/" + id, "", server.as(server.reader)).status == 403);
  CHECK(server.get("/v1/jobs", server.as(server.scraper)).status == 403);
  CHECK(server.get("/metrics", server.as(server.scraper)).status == 200);
  CHECK(server.get("/metrics", server.as(server.alice)).status == 403);
  CHECK(server.get("/metrics", server.as(server.admin)).status == 200);
  CHECK(post(server.port(), "/v1/render", small_job(), server.as(server.alice)).status == 200);
}

TEST_CASE("another owner's job does not exist, whatever is asked of it") {
  const KeyedServer server;
  for (const bool is_running : {false, true}) {
    const std::string id = server.id_in(server.submit(server.alice, is_running ? endless_job() : small_job()));
    const std::string path = "/v1/jobs/" + id, own = server.as(server.alice), other = server.as(server.bob);
    REQUIRE(eventually(
        [&] { return json::parse(server.get(path, own).body).at("state") == (is_running ? "running" : "succeeded"); }));
    for (const auto& [method, rest] : calls_of_a_job) {
      const Reply reply = call(server.port(), method, path + rest, "", other);
      CHECK_MESSAGE(reply.status == 404, method, " ", rest);
      CHECK(reply.body == call(server.port(), method, "/v1/jobs/nobodys" + rest, "", other).body);
    }
    CHECK(server.get(path, own).status == 200);
    CHECK(server.get(path, server.as(server.admin)).status == 200);
    CHECK(call(server.port(), "DELETE", path, "", server.as(is_running ? server.admin : server.alice)).status == 204);
  }
}

TEST_CASE("lists hold one's own jobs, and everybody's for an admin") {
  const KeyedServer server;
  const std::string a = server.id_in(server.submit(server.alice)), b = server.id_in(server.submit(server.bob)),
                    c = server.id_in(server.submit(server.alice));
  const auto ids = [&](const access::NewKey& key, const std::string& query = "") {
    std::vector<std::string> found;
    const json list = json::parse(server.get("/v1/jobs" + query, server.as(key)).body);
    for (const json& job : list.at("jobs")) found.push_back(job.at("id"));
    return found;
  };
  CHECK(ids(server.alice) == std::vector{c, a});
  CHECK(ids(server.reader) == std::vector{c, a});
  CHECK(ids(server.bob) == std::vector{b});
  CHECK(ids(server.admin) == std::vector{c, b, a});
  CHECK(ids(server.alice, "?limit=1") == std::vector{c});
  CHECK(ids(server.bob, "?page_token=" + c) == std::vector{b});
}

TEST_CASE("idempotency keys of two owners have nothing to do with each other") {
  const KeyedServer server;
  const std::string key = "Idempotency-Key: same\r\n";
  const std::string a = server.id_in(server.submit(server.alice, small_job(), key));
  CHECK(server.id_in(server.submit(server.alice, small_job(), key)) == a);
  const Reply other = server.submit(server.bob, small_job(), key);
  CHECK(other.status == 202);
  CHECK(server.id_in(other) != a);
  CHECK(server.submit(server.bob, endless_job(), key).status == 409);
}

TEST_CASE("a key has so many requests a minute, and every answer says how many are left") {
  http::ServerSettings settings;
  settings.guard.requests_per_minute = 3;
  settings.guard.max_jobs = 5;
  const KeyedServer server(settings);
  for (int i = 0; i < 3; ++i) {
    const Reply reply = server.get("/v1/jobs", server.as(server.alice));
    CHECK(reply.status == 200);
    CHECK(reply.headers.at("ratelimit-policy") == "\"requests\";q=3;w=60, \"jobs\";q=5");
    CHECK(reply.headers.at("ratelimit").starts_with("\"requests\";r=" + std::to_string(2 - i) + ";t="));
  }
  const Reply refused = server.get("/v1/jobs", server.as(server.alice));
  CHECK(refused.status == 429);
  CHECK(json::parse(refused.body).at("type") == "/problems/too-many-requests");
  CHECK(json::parse(refused.body).at("detail").get<std::string>().find("3 requests") != std::string::npos);
  CHECK(refused.headers.at("ratelimit").starts_with("\"requests\";r=0;t="));
  CHECK(std::stoi(refused.headers.at("retry-after")) >= 1);
  CHECK(std::stoi(refused.headers.at("retry-after")) <= 20);
  CHECK(server.get("/v1/jobs", server.as(server.bob)).status == 200);
  CHECK(server.get("/healthz", server.as(server.alice)).status == 200);
  CHECK(server.get("/healthz").headers.count("ratelimit") == 0);
}

TEST_CASE("an owner has so many unfinished jobs, and others their own") {
  http::ServerSettings settings;
  settings.guard.max_jobs = 2;
  jobs::Settings jobs;
  jobs.jobs = 1;
  const KeyedServer server(settings, jobs);
  const std::string first = server.id_in(server.submit(server.alice, endless_job()));
  CHECK(server.submit(server.alice, endless_job()).status == 202);
  for (const char* path : {"/v1/jobs", "/v1/render"}) {
    const Reply refused = post(server.port(), path, small_job(), server.as(server.alice));
    CHECK(refused.status == 429);
    CHECK(json::parse(refused.body).at("type") == "/problems/too-many-jobs");
    CHECK(json::parse(refused.body).at("detail").get<std::string>().find("at most 2") != std::string::npos);
    CHECK(std::stoi(refused.headers.at("retry-after")) >= 1);
  }
  CHECK(server.submit(server.bob).status == 202);
  CHECK(call(server.port(), "DELETE", "/v1/jobs/" + first, "", server.as(server.alice)).status == 204);
  CHECK(eventually([&] { return server.submit(server.alice).status == 202; }));
}

TEST_CASE("a body is not even asked for from who may not send it") {
  const KeyedServer server;
  Client client(server.port());
  client.send(
      "POST /v1/jobs HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\nContent-Length: 10\r\n"
      "Expect: 100-continue\r\n\r\n");
  CHECK(client.reply()->status == 401);
  CHECK(client.is_closed_by_server());
}

TEST_CASE("streams are shared out among clients") {
  http::ServerSettings settings;
  settings.streams.of_one_client = 1;
  const KeyedServer server(settings);
  const std::string id = server.id_in(server.submit(server.alice, endless_job()));
  const auto open = [&](Client& client, const access::NewKey& key) {
    client.send("GET /v1/jobs/" + id + "/events HTTP/1.1\r\nHost: a\r\n" + server.as(key) + "\r\n");
    return client.head()->status == 200 && client.event().has_value();
  };
  Client first(server.port()), second(server.port()), third(server.port());
  CHECK(open(first, server.alice));
  CHECK_FALSE(open(second, server.alice));
  CHECK(open(third, server.reader));
}

TEST_CASE("with the key its streams and the renders that wait for it end within a second") {
  KeyedServer server;
  const std::string job = "/v1/jobs/" + server.id_in(server.submit(server.alice, endless_job()));
  Client stream(server.port()), render(server.port()), other(server.port());
  stream.send("GET " + job + "/events HTTP/1.1\r\nHost: a\r\n" + server.as(server.alice) + "\r\n");
  CHECK(stream.event());
  const std::string body = endless_job(fresh_seed());
  render.send("POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\n" + server.as(server.alice) +
              "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  other.send("GET " + job + "/events HTTP/1.1\r\nHost: a\r\n" + server.as(server.reader) + "\r\n");
  CHECK(other.event());
  REQUIRE(eventually([&] { return server.jobs_of(server.admin) == 2; }));
  const auto start = std::chrono::steady_clock::now();
  server.revoke_alice();
  CHECK(render.reply()->status == 409);
  while (stream.event()) {
  }
  // A second, and what a busy machine takes.
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(3));
  CHECK(server.get(job, server.as(server.alice)).status == 401);
  CHECK(other.event());
}

TEST_CASE("with a token instead of a key a browser reads what one owner has, and nothing else") {
  const KeyedServer server;
  const auto token_of = [&](const access::NewKey& key) {
    const Reply reply = call(server.port(), "POST", "/v1/tokens", "", server.as(key));
    CHECK(reply.status == 201);
    CHECK(reply.headers.at("cache-control") == "no-store");
    const json body = json::parse(reply.body);
    CHECK(body.at("expires_in") == 600);
    CHECK(body.at("token_type") == "Bearer");
    return body.at("access_token").get<std::string>();
  };
  const std::string id = server.id_in(server.submit(server.alice)), job = "/v1/jobs/" + id;
  const auto is_done = [&] { return server.get(job + "/image", server.as(server.alice)).status == 200; };
  REQUIRE(eventually(is_done));
  const std::string alice = "?access_token=" + token_of(server.alice), bob = "?access_token=" + token_of(server.bob);

  for (const std::string& path : {job + "/image", job + "/preview", job + "/events"}) {
    CHECK(server.get(path + alice).status == 200);
    CHECK(server.get(path + bob).status == 404);
    CHECK(server.get(path + alice + "x").status == 401);
    CHECK(server.get(path + "?access_token=").status == 401);
    CHECK(server.get(path + "?access_token=" + server.alice.text).status == 401);  // keys stay out of addresses
    CHECK(server.get(path + alice, server.as(server.bob)).status == 404);  // the field counts where there is one
  }
  // An administrator's token is for the administrator's own jobs.
  CHECK(server.get(job + "/image?access_token=" + token_of(server.admin)).status == 404);
  // No other call takes one.
  CHECK(server.get(job + alice).status == 401);
  CHECK(server.get("/v1/jobs" + alice).status == 401);
  CHECK(call(server.port(), "DELETE", job + alice).status == 401);
  CHECK(call(server.port(), "POST", "/v1/tokens" + alice).status == 401);
  CHECK(call(server.port(), "POST", "/v1/tokens", "", server.as(server.scraper)).status == 403);
}
