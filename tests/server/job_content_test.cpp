#include <doctest/doctest.h>

#include "engine/output/encode.h"
#include "engine/system/pool.h"
#include "server/store/sha256.h"
#include "tests/server/fixture.h"

// What a job tells of itself beyond its state: its scene, what its image is like, and that image in small.

using nlohmann::json;
using namespace penumbra;

namespace {

/// Width and height in the header of a PNG file.
std::pair<unsigned, unsigned> png_size(const std::string& bytes) {
  REQUIRE(bytes.starts_with("\x89PNG"));
  const auto number = [&](std::size_t place) {
    unsigned value = 0;
    for (std::size_t i = place; i < place + 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes.at(i));
    return value;
  };
  return {number(16), number(20)};
}

Reply get(const TestServer& server, const std::string& id, const std::string& what, const std::string& headers = "") {
  return call(server.port(), "GET", "/v1/jobs/" + id + what, "", headers);
}

std::string type_of(const Reply& reply) { return json::parse(reply.body).at("type"); }

}  // namespace

TEST_CASE("a job tells the name of its scene and what its image is like, wherever it is shown") {
  const TestServer server;
  const std::string body =
      R"({"scene": {"name": "Ball – \"one\"", "camera": {"position": [0, 0, 5], "direction": [0, 0, -1],)"
      R"("vertical_fov": 40}}, "options": {"width": 20, "height": 10, "format": "exr"}})";
  const json accepted = json::parse(post(server.port(), "/v1/jobs", body).body);
  const std::string id = accepted.at("id");
  CHECK(accepted.at("links").at("scene") == "/v1/jobs/" + id + "/scene");
  CHECK(accepted.at("links").at("thumbnail") == "/v1/jobs/" + id + "/thumbnail");
  REQUIRE(server.reaches(id, "succeeded"));
  const std::size_t size = get(server, id, "/image").body.size();
  const json listed = json::parse(call(server.port(), "GET", "/v1/jobs").body).at("jobs").at(0);
  const json again = json::parse(post(server.port(), "/v1/jobs", body).body);  // has the image at once
  for (const json& job : {accepted, server.job(id), listed, again}) {
    CHECK(job.at("name") == "Ball – \"one\"");
    CHECK(job.at("width") == 20);
    CHECK(job.at("height") == 10);
    CHECK(job.at("format") == "exr");
    if (job == accepted) {
      CHECK(job.at("size_bytes").is_null());
    } else {
      CHECK(job.at("size_bytes") == size);
    }
  }
}

TEST_CASE("the scene of a job is its body, byte for byte, in every state") {
  const TestServer server;
  const std::string running = endless_job(), good = "\n " + small_job() + "\t";
  const std::string first = server.submit(running);
  REQUIRE(server.reaches(first, "running"));
  const std::string second = server.submit(good);
  REQUIRE(server.reaches(second, "succeeded"));
  CHECK(get(server, first, "/scene").body == running);
  const Reply scene = get(server, second, "/scene");
  CHECK(scene.status == 200);
  CHECK(scene.headers.at("content-type") == "application/json");
  CHECK(scene.headers.at("cache-control") == "private, no-cache");
  CHECK(scene.body == good);
  const std::string tag = scene.headers.at("etag");
  CHECK(get(server, second, "/scene", "If-None-Match: " + tag + "\r\n").status == 304);
  CHECK(get(server, second, "/scene", "If-None-Match: \"x\"\r\n").status == 200);
  const Reply head = call(server.port(), "HEAD", "/v1/jobs/" + second + "/scene");
  CHECK(head.headers.at("content-length") == std::to_string(good.size()));
  call(server.port(), "POST", "/v1/jobs/" + first + "/cancel");
  REQUIRE(server.reaches(first, "canceled"));
  CHECK(get(server, first, "/scene").body == running);
  call(server.port(), "DELETE", "/v1/jobs/" + first);
  CHECK(get(server, first, "/scene").status == 404);
}

TEST_CASE("a scene that is kept no more is gone, and the job stays") {
  jobs::Settings settings;
  settings.retention.max_spec_bytes = 0;
  const TestServer server(settings);
  const std::string id = server.submit(small_job());
  REQUIRE(server.reaches(id, "succeeded"));
  const Reply gone = get(server, id, "/scene");
  CHECK(gone.status == 410);
  CHECK(type_of(gone) == "/problems/scene-expired");
  CHECK(get(server, id, "/image").status == 200);
}

TEST_CASE("a thumbnail is a PNG of at most 256 pixels at the longer edge, once the image is there") {
  const TestServer server;
  const std::string running = server.submit(endless_job());
  const Reply early = get(server, running, "/thumbnail");
  CHECK(early.status == 409);
  CHECK(type_of(early) == "/problems/no-image");
  CHECK(early.headers.contains("retry-after"));
  call(server.port(), "POST", "/v1/jobs/" + running + "/cancel");
  REQUIRE(server.reaches(running, "canceled"));
  CHECK(get(server, running, "/thumbnail").status == 409);
  CHECK(get(server, "01JDF3Z4N6Q8R0S2T4V6X8Y0Z2", "/thumbnail").status == 404);

  using Size = std::pair<unsigned, unsigned>;
  for (const auto& [options, size] : std::initializer_list<std::pair<const char*, Size>>{
           {R"("width": 512, "height": 300)", {256, 150}},
           {R"("width": 10, "height": 1000, "format": "exr")", {3, 256}},
           {R"("width": 256, "height": 16)", {256, 16}},
           {R"("width": 17, "height": 16, "format": "exr")", {17, 16}}}) {
    CAPTURE(options);
    const std::string id = server.submit(small_job(options));
    REQUIRE(server.reaches(id, "succeeded"));
    const Reply thumbnail = get(server, id, "/thumbnail");
    CHECK(thumbnail.status == 200);
    CHECK(thumbnail.headers.at("content-type") == "image/png");
    CHECK(thumbnail.headers.at("cache-control") == "private, no-cache");
    CHECK(png_size(thumbnail.body) == size);
    const std::string tag = thumbnail.headers.at("etag");
    const Reply same = get(server, id, "/thumbnail", "If-None-Match: " + tag + "\r\n");
    CHECK(same.status == 304);
    CHECK(same.body.empty());
  }
}

TEST_CASE("a thumbnail expires with its image") {
  jobs::Settings settings;
  settings.retention.max_image_bytes = 0;
  const TestServer server(settings);
  const std::string id = server.submit(small_job(R"("width": 300, "height": 2)"));
  REQUIRE(server.reaches(id, "succeeded"));
  const Reply gone = get(server, id, "/thumbnail");
  CHECK(gone.status == 410);
  CHECK(type_of(gone) == "/problems/image-expired");
  CHECK(server.job(id).at("size_bytes").is_null());
}

TEST_CASE("images from before there were thumbnails have one all the same") {
  TestStore kept;
  system::Pool pool(1);
  const jobs::JobManager manager({}, kept, pool);
  render::Film film(600, 3);
  const auto bytes = std::make_shared<const std::string>(output::encode(film, {}));
  store::JobRecord record;
  record.id = "01JDF3Z4N6Q8R0S2T4V6X8Y0Z2";
  kept.create(record, "body", {});
  store::Ending ending;
  ending.image = store::Image{bytes, "image/png", store::sha256_hex(*bytes), nullptr, nullptr};
  ending.finished_at = std::chrono::system_clock::now();
  REQUIRE(kept.finish(record.id, ending));
  const auto found = manager.thumbnail(record.id);
  REQUIRE(found->state == store::ImageState::present);
  CHECK(png_size(*found->image.bytes) == std::pair(256U, 1U));
  CHECK(found->image.sha256 == store::sha256_hex(*found->image.bytes));
}
