#include <doctest/doctest.h>

#include <chrono>
#include <cmath>

#include "api/cost.h"
#include "api/job_request.h"
#include "api/json_reader.h"
#include "api/problem.h"
#include "tests/api/corpus.h"
#include "tests/support/picture.h"

using namespace penumbra;

namespace {

std::optional<api::Problem> refusal(const std::string& body, const api::Limits& limits = {}) {
  try {
    api::parse_job(body, limits);
  } catch (const api::InvalidBody& error) {
    return error.problem();
  }
  return std::nullopt;
}

std::string repeated(const std::string& text, std::size_t count) {
  std::string result;
  result.reserve(text.size() * count);
  for (std::size_t i = 0; i < count; ++i) result += text;
  return result;
}

std::string job(const std::string& scene, const std::string& options = "{}") {
  return R"({"scene": {"camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40})" + scene +
         R"(}, "options": )" + options + "}";
}

std::string list(const std::string& element, std::size_t count) {
  return std::string("[").append(repeated(element + ",", count - 1)).append(element).append("]");
}

}  // namespace

TEST_CASE("a body over the limit is a 413, whatever it says") {
  const auto problem = refusal(std::string(10'000'000, '['));
  REQUIRE(problem);
  CHECK(problem->status == 413);
  CHECK(problem->detail.find("8388608") != std::string::npos);
  api::Limits limits;
  limits.max_body_bytes = 10;
  CHECK(refusal(job(""), limits).value().status == 413);
}

TEST_CASE("deep nesting is refused where it begins, however deep it goes") {
  api::Limits limits;
  limits.max_body_bytes = 1u << 30;
  for (const std::size_t depth : {65u, 100'000u, 10'000'000u}) {
    const auto problem = refusal(std::string(depth, '['), limits);
    REQUIRE(problem);
    CHECK(problem->status == 422);
    REQUIRE(problem->errors.size() == 1);
    CHECK(problem->errors[0].pointer == repeated("/0", 64));
  }
  const auto objects = refusal(repeated(R"({"a":)", 100'000));
  REQUIRE(objects);
  CHECK(objects->status == 422);
  CHECK(objects->errors.at(0).pointer == repeated("/a", 64));
  CHECK(refusal(std::string(64, '[') + std::string(64, ']')).value().errors.at(0).pointer.empty());
  limits = {};
  limits.max_json_depth = 3;
  CHECK(refusal("[[[[", limits).value().errors.at(0).pointer == "/0/0/0");
}

TEST_CASE("long strings and names are refused") {
  CHECK_FALSE(refusal(job(R"(, "name": ")" + std::string(65'536, 'x') + '"')));
  const auto name = refusal(job(R"(, "name": ")" + std::string(65'537, 'x') + '"'));
  REQUIRE(name);
  CHECK(name->status == 422);
  CHECK(name->errors.at(0).pointer == "/scene/name");
  const auto key = refusal(job(R"(, "materials": {")" + std::string(1'000'000, 'x') + R"(": {}})"));
  REQUIRE(key);
  CHECK(key->status == 422);
  CHECK(key->errors.at(0).pointer == "/scene/materials");
  CHECK(to_json(*key).size() < 1000);
}

TEST_CASE("a body of a million empty values is refused, and quickly") {
  const auto start = std::chrono::steady_clock::now();
  for (const char* element : {"[]", "{}", "\"\"", "null", "[1]", "{\"\":0}"}) {
    const auto problem = refusal(job(R"(, "objects": )" + list(element, 1'000'000)));
    REQUIRE(problem);
    CHECK(problem->status == 422);
    CHECK(problem->errors.at(0).pointer.rfind("/scene/objects", 0) == 0);
  }
  const auto mixed = refusal(job(R"(, "objects": [)" + repeated("1,", 2'000'000) + "null]"));
  REQUIRE(mixed);
  CHECK(mixed->errors.at(0).pointer == "/scene/objects");
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(30));
}

TEST_CASE("numbers in bulk are read into 8 bytes each") {
  const std::string positions = list("0.5", 900'000);
  const std::string mesh =
      R"(, "meshes": {"m": {"positions": )" + positions + R"(, "indices": )" + list("299999", 900'000) + "}}";
  const api::JsonDocument document = api::read_json(positions);
  CHECK(document.nodes.size() == 1);
  CHECK(document.numbers.size() == 900'000);
  api::Limits limits;
  limits.max_body_bytes = 1u << 30;
  const api::JobRequest request = api::parse_job(job(mesh), limits);
  CHECK(request.scene.meshes.at(0).positions.size() == 300'000);
  CHECK(request.scene.meshes.at(0).triangles.size() == 300'000);
}

TEST_CASE("invalid UTF-8 and zero bytes are not JSON") {
  for (const char* bytes : {"\xff", "\xc0\xaf", "\xe2\x82", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\x80"}) {
    const auto problem = refusal(job(std::string(R"(, "name": ")") + bytes + '"'));
    REQUIRE(problem);
    CHECK(problem->status == 400);
    CHECK(problem->detail.find("byte 1") != std::string::npos);
  }
  CHECK(refusal(job("") + std::string(1, '\0')).value().status == 400);
  CHECK(refusal(job("") + std::string(1, '\0') + "garbage").value().status == 400);
  CHECK(refusal(std::string("\xef\xbb\xbf") + job("")).value().status == 400);
  for (const char* surrogate : {R"(\ud800)", R"(\udc00)", R"(\ud800\u0041)"}) {
    CHECK(refusal(job(std::string(R"(, "name": ")") + surrogate + '"')).value().status == 400);
  }
}

TEST_CASE("the place of a syntax error is named") {
  const auto problem = refusal("{\n  \"scene\": nul\n}");
  REQUIRE(problem);
  CHECK(problem->detail.find("byte 17 (line 2, column 15)") != std::string::npos);
  // What was read is not echoed: it may be anything.
  CHECK(refusal(std::string("{\"") + std::string(1'000'000, 'x')).value().detail.size() < 300);
}

TEST_CASE("at most a hundred errors are listed") {
  const auto problem = refusal(job(R"(, "objects": )" + list("{}", 90'000)));
  REQUIRE(problem);
  CHECK(problem->errors.size() == 100);
  CHECK(problem->errors.back().pointer == "/scene/objects/99/type");
  std::string options = "{";
  for (int i = 0; i < 500; ++i) options += std::string(i > 0 ? ",\"x" : "\"x") + std::to_string(i) + "\": 1";
  CHECK(refusal(job("", options + "}")).value().errors.size() == 100);
  std::string twice = "{";
  for (int i = 0; i < 500; ++i) twice += std::string(i > 0 ? ",\"x" : "\"x") + std::to_string(i % 250) + "\": 1";
  CHECK(refusal(job("", twice + "}")).value().errors.size() == 100);
}

TEST_CASE("a member named twice among very many is found") {
  std::string materials;
  for (int i = 0; i < 200'000; ++i) materials.append("\"").append(std::to_string(i)).append("\":{},");
  const auto problem = refusal(job(R"(, "materials": {)" + materials + R"("123456": {}})"));
  REQUIRE(problem);
  CHECK(problem->status == 422);
  REQUIRE(problem->errors.size() == 1);
  CHECK(problem->errors[0].pointer == "/scene/materials/123456");
}

TEST_CASE("limits on the scene name their value") {
  const std::string sphere = R"({"type": "sphere", "center": [0, 0, 0], "radius": 1})";
  api::Limits limits;
  limits.max_primitives = 3;
  CHECK_FALSE(refusal(job(R"(, "objects": )" + list(sphere, 3)), limits));
  const auto objects = refusal(job(R"(, "objects": [{"type": "group", "objects": )" + list(sphere, 3) + "}]"), limits);
  REQUIRE(objects);
  CHECK(objects->errors.at(0).pointer == "/scene/objects");
  CHECK(objects->errors.at(0).detail.find("more than 3 objects") != std::string::npos);

  limits = {};
  limits.max_triangles = 1;
  const std::string mesh = R"({"positions": [0, 0, 0], "indices": [0, 0, 0, 0, 0, 0]})";
  const auto triangles = refusal(job(R"(, "meshes": {"m": )" + mesh + "}"), limits);
  REQUIRE(triangles);
  CHECK(triangles->errors.at(0).pointer == "/scene");
  CHECK(triangles->errors.at(0).detail.find("more than 1 triangles") != std::string::npos);

  limits = {};
  limits.max_lights = 2;
  const std::string light = R"({"type": "point", "position": [0, 5, 0], "intensity": 1})";
  CHECK_FALSE(refusal(job(R"(, "lights": )" + list(light, 2)), limits));
  const auto lights = refusal(job(R"(, "lights": )" + list(light, 3)), limits);
  REQUIRE(lights);
  CHECK(lights->errors.at(0).pointer == "/scene/lights");
  CHECK(lights->errors.at(0).detail.find("more than 2 lights") != std::string::npos);

  limits = {};
  limits.max_string_bytes = 10;
  const auto string = refusal(job(R"(, "name": "elevenbytes")"), limits);
  REQUIRE(string);
  CHECK(string->errors.at(0).detail.find("longer than 10 bytes") != std::string::npos);
}

TEST_CASE("limits on the options and on what a job needs name their value") {
  api::Limits limits;
  limits.max_edge_pixels = 100;
  limits.max_samples = 5;
  limits.max_depth = 2;
  CHECK_FALSE(refusal(job("", R"({"width": 100, "height": 100, "shadow_samples": 5, "max_depth": 2})"), limits));
  const auto options =
      refusal(job("", R"({"width": 101, "height": 100, "shadow_samples": 6, "max_depth": 3})"), limits);
  REQUIRE(options);
  REQUIRE(options->errors.size() == 3);
  CHECK(options->errors[0] == api::FieldError{"/options/width", "must be an integer from 1 to 100"});
  CHECK(options->errors[1] == api::FieldError{"/options/shadow_samples", "must be an integer from 1 to 5"});
  CHECK(options->errors[2] == api::FieldError{"/options/max_depth", "must be an integer from 0 to 2"});
  CHECK(options->detail == "/options/width: must be an integer from 1 to 100 (and 2 more)");

  limits = {};
  limits.max_memory_bytes = 1000;
  const auto memory = refusal(job(""), limits);
  REQUIRE(memory);
  CHECK(memory->status == 422);
  CHECK(memory->errors.at(0).pointer == "/options");
  CHECK(memory->errors.at(0).detail.find("1000 bytes") != std::string::npos);

  limits = {};
  limits.max_work = 50;
  const auto work = refusal(job("", R"({"width": 10, "height": 10})"), limits);
  REQUIRE(work);
  CHECK(work->status == 422);
  CHECK(work->errors.at(0).detail.find("at most 50; it is 100") != std::string::npos);
}

TEST_CASE("what a scene is made of is counted, a shared mesh once") {
  const std::string flat = R"("positions": [0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0], "indices": [0, 1, 2, 2, 1, 3])";
  const std::string smooth = flat + R"(, "normals": [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1])";
  const std::string instance =
      R"({"type": "instance", "mesh": "m", "transform": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]})";
  const std::string polygon = R"({"type": "polygon", "vertices": [[0,0,0], [1,0,0], [2,1,0], [1,2,0], [0,2,0]]})";
  const api::SceneSize size = api::size_of(
      api::parse_job(job(R"(, "meshes": {"m": {)" + smooth + R"(}}, "objects": [{"type": "mesh", )" + flat + "}, " +
                         polygon + R"(, {"type": "group", "objects": )" + list(instance, 3) + "}]"))
          .scene);
  CHECK(size.primitives == 6);
  CHECK(size.triangles == 4);
  CHECK(size.positions == 8);
  CHECK(size.smooth_triangles == 2);
  CHECK(size.polygon_vertices == 5);
}

TEST_CASE("the predicted memory is at least what the values themselves take") {
  const auto memory = [](const std::string& scene) {
    return api::estimate_cost(api::parse_job(job(scene))).memory_bytes;
  };
  const std::size_t count = 50, nothing = memory("");
  CHECK(nothing >= 800 * 800 * sizeof(std::array<float, 3>));
  const auto each_more = [&](const std::string& scene) { return (memory(scene) - nothing) / count; };
  std::string materials = R"("0": {})";
  for (std::size_t i = 1; i < count; ++i) materials.append(", \"").append(std::to_string(i)).append("\": {}");
  CHECK(each_more(R"(, "materials": {)" + materials + "}") >= sizeof(scene::Material));
  const std::string light = R"({"type": "point", "position": [0, 5, 0], "intensity": 1})";
  CHECK(each_more(R"(, "lights": )" + list(light, count)) >= sizeof(scene::Light));
  const std::string sphere = R"({"type": "sphere", "center": [0, 0, 0], "radius": 1})";
  CHECK(each_more(R"(, "objects": )" + list(sphere, count)) >= sizeof(scene::Object));
  const auto mesh = [&](std::size_t positions, std::size_t triangles) {
    return R"(, "meshes": {"m": {"positions": )" + list("0, 0, 0", positions) + R"(, "indices": )" +
           list("0, 0, 0", triangles) + "}}";
  };
  const std::size_t least = memory(mesh(1, 1));
  CHECK((memory(mesh(1 + count, 1)) - least) / count >= sizeof(math::Vec3));
  CHECK((memory(mesh(1, 1 + count)) - least) / count >= sizeof(std::array<std::uint32_t, 3>));
}

TEST_CASE("the slowest polygons are refused or read quickly") {
  std::string zigzag = "[0, -2, 0]";
  for (int i = 0; i < 998; ++i) {
    zigzag += std::string(", [") + std::to_string(i % 2 == 0 ? 1000 : 1) + ", " + std::to_string(i) + ", 0]";
  }
  zigzag += ", [0, 1000, 0]";
  const std::string polygon = R"({"type": "polygon", "vertices": [)" + zigzag + "]}";
  const auto start = std::chrono::steady_clock::now();
  api::Limits limits;
  CHECK_FALSE(refusal(job(R"(, "objects": )" + list(polygon, 500)), limits));
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(20));
}

TEST_CASE("work counts pixels, samples, lights, and the rays that a camera ray can become") {
  const auto work = [](const std::string& scene, const std::string& options) {
    return api::estimate_cost(api::parse_job(job(scene, options))).work;
  };
  const std::string size = R"("width": 10, "height": 10)";
  CHECK(work("", "{" + size + "}") == 100);
  CHECK(work("", "{" + size + R"(, "samples_per_pixel": 4})") == 400);
  CHECK(work("", "{" + size + R"(, "samples_per_pixel": 4, "target_error": 1})") == 400);
  const std::string lights =
      R"(, "lights": [{"type": "point", "position": [0, 0, 0], "intensity": 1},
                      {"type": "point", "position": [0, 0, 0], "intensity": 1, "radius": 1}])";
  CHECK(work(lights, "{" + size + R"(, "shadow_samples": 16})") == 100 * (1 + 1 + 16));
  CHECK(work(lights, "{" + size + R"(, "samples_per_pixel": 4, "shadow_samples": 3, "target_error": 1})") ==
        400 * (1 + 1 + 3));
  const std::string mirror = R"(, "materials": {"m": {"reflection": 1}})";
  CHECK(work(mirror, "{" + size + R"(, "max_depth": 7})") == 100 * 8);
  const std::string dim = R"(, "materials": {"m": {"transmission": 0.1}})";
  CHECK(work(dim, "{" + size + R"(, "max_depth": 7, "min_contribution": 0.05})") == 100 * 2);
  // A mirror and a pane leave one ray each; a mirror that is a pane doubles them, which counts when it gets out of
  // hand.
  const std::string apart = R"(, "materials": {"m": {"reflection": 1}, "p": {"transmission": 1}})";
  CHECK(work(apart, "{" + size + R"(, "max_depth": 7})") == 100 * 8);
  const std::string both = R"(, "materials": {"m": {"reflection": 1, "transmission": 1}})";
  CHECK(work(both, "{" + size + R"(, "max_depth": 7})") == 100 * 8);
  CHECK(work(both, "{" + size + R"(, "max_depth": 19})") == 100 * (std::exp2(20) - 1));
  const std::string glass = R"(, "materials": {"m": {"reflection": 0.1, "transmission": 0.9}})";
  CHECK(work(glass, "{" + size + R"(, "max_depth": 32})") == 100 * 33);
  // Where one of both is too little to be followed there is no tree.
  for (const char* once : {R"("reflection": 1, "transmission": 0.001)", R"("reflection": 0.001, "transmission": 1)"}) {
    const std::string almost = std::string(R"(, "materials": {"m": {)") + once + "}}";
    CHECK(work(almost, "{" + size + R"(, "max_depth": 32, "min_contribution": 0.01})") == 100 * 33);
  }
  CHECK(refusal(job(both, R"({"width": 100, "height": 100, "max_depth": 32})")));
}

TEST_CASE("a time budget bounds the work; the numbers of samples beside a target are only caps") {
  const std::string scene = R"(, "lights": [{"type": "sphere", "center": [0, 9, 0], "radius": 1, "intensity": 1}])";
  const auto options = [](const std::string& more, int edge = 4000) {
    const std::string size = std::to_string(edge);
    return R"({"samples_per_pixel": 4096, "shadow_samples": 4096, "width": )" + size + R"(, "height": )" + size + more +
           "}";
  };
  const auto work = [&](const std::string& more, int edge) {
    return api::estimate_cost(api::parse_job(job(scene, options(more, edge)))).work;
  };
  CHECK(refusal(job(scene, options(""))));
  CHECK_FALSE(refusal(job(scene, options(R"(, "time_budget_s": 3600)"))));
  CHECK_FALSE(refusal(job(scene, options(R"(, "target_error": 0.01)"))));
  CHECK(work(R"(, "time_budget_s": 60)", 400) == 60 * api::work_of_a_second);
  CHECK(work(R"(, "target_error": 0.01)", 400) == 400. * 400 * 8 * (1 + 8));
  CHECK(work(R"(, "target_error": 0.01, "time_budget_s": 1e8)", 400) == 400. * 400 * 8 * (1 + 8));
  // Neither makes a small job a large one.
  CHECK(work("", 4) == work(R"(, "time_budget_s": 3600)", 4));

  // What they do not bound is refused as before.
  CHECK(refusal(job(scene, options(R"(, "time_budget_s": 1e8)"))));
  const std::string tree = scene + R"(, "materials": {"m": {"reflection": 1, "transmission": 1}})";
  for (const char* bound : {R"(, "max_depth": 32, "time_budget_s": 1)", R"(, "max_depth": 32, "target_error": 1)"})
    CHECK(refusal(job(tree, options(bound))));
  api::Limits limits;
  limits.max_memory_bytes = 1 << 20;
  for (const char* bound : {R"(, "time_budget_s": 1)", R"(, "target_error": 1)"})
    CHECK(refusal(job(scene, options(bound)), limits));
}

TEST_CASE("the least that a budget or a target takes is what the renderer does") {
  const std::string wall = R"(, "ambient": 1, "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}])";
  for (const char* bound : {R"("time_budget_s": 1e-9)", R"("target_error": 0.01)"}) {
    const api::JobRequest request = api::parse_job(
        job(wall, std::string(R"({"width": 100, "height": 70, "samples_per_pixel": 64, )") + bound + "}"));
    const auto rays = static_cast<double>(test::render(request).stats.rays.camera);
    const double work = api::estimate_cost(request).work;
    CHECK(rays >= work);
    CHECK(rays <= (request.options.target_error ? 1.1 : 1) * work);  // some around a tile are not counted
  }
}
