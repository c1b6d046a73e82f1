#include <doctest/doctest.h>

#include <variant>

#include "api/job_request.h"
#include "api/problem.h"
#include "tests/api/corpus.h"

using namespace penumbra;
using math::Color;
using math::Vec3;

namespace {

const std::string everything = R"({
  "scene": {
    "name": "all",
    "camera": {"position": [1, 2, 3], "look_at": [1, 2, 0], "up": [1, 0, 0], "projection": "orthographic",
               "view_plane": {"width": 4, "height": 5}, "lens": {"aperture_radius": 0.5, "focus_distance": 6}},
    "background": [0.1, 0.2, 0.3], "ambient": 0.4,
    "materials": {"b": {"diffuse": 1}, "a": {"emission": 1, "ambient": 2, "diffuse": 3, "specular": 4, "shininess": 5,
                                              "reflection": [0.1, 0.2, 0.3], "transmission": 0.5, "ior": 1.5}},
    "meshes": {"m": {"positions": [0, 0, 0, 1, 0, 0, 0, 1, 0], "indices": [0, 1, 2], "normals": [0, 0, 1, 0, 0, 2, 0, 1, 1]}},
    "objects": [
      {"type": "sphere", "center": [1, 2, 3], "radius": 4, "material": "a"},
      {"type": "plane", "point": [1, 2, 3], "normal": [4, 5, 6]},
      {"type": "cylinder", "point": [1, 2, 3], "direction": [4, 5, 6], "radius": 7, "height": 8, "caps": false, "material": {"specular": 9}},
      {"type": "group", "transform": [1, 2, 3, 0, 4, 5, 7, 0, 7, 8, 8, 0, 10, 11, 12, 1],
       "objects": [{"type": "instance", "mesh": "m", "transform": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1], "material": "b"}]},
      {"type": "tube", "point": [1, 2, 3], "direction": [4, 5, 6], "radius": 7}
    ],
    "lights": [
      {"type": "spot", "position": [1, 2, 3], "direction": [4, 5, 6], "intensity": [7, 8, 9], "attenuation": [1, 2, 3], "radius": 4,
       "exponent": 5, "cutoff": 60},
      {"type": "directional", "direction": [1, 2, 3], "intensity": 4, "angular_radius": 5},
      {"type": "rectangle", "corner": [1, 2, 3], "edge_u": [4, 5, 6], "edge_v": [7, 8, 8], "intensity": 9},
      {"type": "sphere", "center": [1, 2, 3], "radius": 4, "intensity": 5},
      {"type": "point", "position": [1, 2, 3], "intensity": 4}
    ]
  },
  "options": {"width": 20, "height": 10, "samples_per_pixel": 2, "shadow_samples": 3, "target_error": 0.25, "time_budget_s": 4.5,
              "max_depth": 5, "min_contribution": 0.5, "threads": -2, "acceleration": "median", "seed": 18446744073709551615,
              "exposure": -1.5,
              "transfer": "linear", "format": "exr", "bit_depth": 16, "progress_interval_s": 0.125, "priority": -7}
})";

template <class Alternative, class Variant>
const Alternative& as(const Variant& variant) {
  REQUIRE(std::holds_alternative<Alternative>(variant));
  return std::get<Alternative>(variant);
}

std::string body_with_options(const std::string& options) {
  return R"({"scene": {"camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40}}, "options": )" +
         options + "}";
}

}  // namespace

TEST_CASE("the camera, the background and the lights arrive as they were written") {
  const scene::Description scene = api::parse_job(everything).scene;
  CHECK(scene.name == "all");
  CHECK(scene.camera.position == Vec3{1, 2, 3});
  CHECK(scene.camera.direction == Vec3{0, 0, -3});
  CHECK(scene.camera.up == Vec3{1, 0, 0});
  CHECK(scene.camera.projection == scene::Projection::orthographic);
  CHECK(scene.camera.view_plane.value().width == 4);
  CHECK(scene.camera.view_plane.value().height == 5);
  CHECK_FALSE(scene.camera.vertical_fov_degrees);
  CHECK(scene.camera.lens.value().aperture_radius == 0.5);
  CHECK(scene.camera.lens.value().focus_distance == 6);
  CHECK(scene.background == Color{0.1, 0.2, 0.3});
  CHECK(scene.ambient == math::grey(0.4));
  REQUIRE(scene.lights.size() == 5);
  CHECK(as<scene::SpotLight>(scene.lights[0]) ==
        scene::SpotLight{{1, 2, 3}, {7, 8, 9}, {1, 2, 3}, 4, {4, 5, 6}, 5, 60});
  CHECK(as<scene::DirectionalLight>(scene.lights[1]) == scene::DirectionalLight{{1, 2, 3}, math::grey(4), 5});
  CHECK(as<scene::RectangleLight>(scene.lights[2]) ==
        scene::RectangleLight{{1, 2, 3}, {4, 5, 6}, {7, 8, 8}, math::grey(9)});
  CHECK(as<scene::SphereLight>(scene.lights[3]) == scene::SphereLight{{1, 2, 3}, 4, math::grey(5)});
  CHECK(as<scene::PointLight>(scene.lights[4]) == scene::PointLight{{1, 2, 3}, math::grey(4), {1, 0, 0}, 0});
}

TEST_CASE("objects arrive as they were written, with their materials") {
  const scene::Description scene = api::parse_job(everything).scene;
  const auto material_of = [&](const scene::Object& object) {
    return scene.materials.at(static_cast<std::size_t>(object.material));
  };
  REQUIRE(scene.objects.size() == 5);
  CHECK(as<scene::Sphere>(scene.objects[0].shape).center == Vec3{1, 2, 3});
  CHECK(as<scene::Sphere>(scene.objects[0].shape).radius == 4);
  CHECK(material_of(scene.objects[0]) ==
        scene::Material{
            math::grey(1), math::grey(2), math::grey(3), math::grey(4), 5, {0.1, 0.2, 0.3}, math::grey(0.5), 1.5});
  CHECK(as<scene::Plane>(scene.objects[1].shape).normal == Vec3{4, 5, 6});
  CHECK(material_of(scene.objects[1]) == scene::default_material());
  const auto& cylinder = as<scene::Cylinder>(scene.objects[2].shape);
  CHECK(cylinder.point == Vec3{1, 2, 3});
  CHECK(cylinder.direction == Vec3{4, 5, 6});
  CHECK(cylinder.radius == 7);
  CHECK(cylinder.height == 8);
  CHECK_FALSE(cylinder.caps);
  CHECK(material_of(scene.objects[2]).specular == math::grey(9));
  const auto& group = as<scene::Group>(scene.objects[3].shape);
  CHECK(group.transform == math::Affine{{{1, 2, 3}, {4, 5, 7}, {7, 8, 8}}, {10, 11, 12}});
  REQUIRE(group.objects.size() == 1);
  const auto& instance = as<scene::Instance>(group.objects[0].shape);
  CHECK(instance.transform.column[1] == Vec3{0, 2, 0});
  const scene::Mesh& mesh = scene.meshes.at(static_cast<std::size_t>(instance.mesh));
  CHECK(mesh.positions == std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  CHECK(mesh.triangles == std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}});
  CHECK(mesh.normals == std::vector<Vec3>{{0, 0, 1}, {0, 0, 2}, {0, 1, 1}});
  CHECK(material_of(group.objects[0]).diffuse == math::grey(1));
  CHECK(as<scene::Tube>(scene.objects[4].shape).radius == 7);
}

TEST_CASE("options arrive as they were written") {
  const scene::Options options = api::parse_job(everything).options;
  CHECK(options.width == 20);
  CHECK(options.height == 10);
  CHECK(options.samples_per_pixel == 2);
  CHECK(options.shadow_samples == 3);
  CHECK(options.target_error == 0.25);
  CHECK(options.time_budget_s == 4.5);
  CHECK(options.max_depth == 5);
  CHECK(options.min_contribution == 0.5);
  CHECK(options.threads == -2);
  CHECK(options.acceleration == scene::Acceleration::median);
  CHECK(options.seed == 18446744073709551615u);
  CHECK(options.exposure == -1.5);
  CHECK(options.transfer == scene::Transfer::linear);
  CHECK(options.format == scene::ImageFormat::exr);
  CHECK(options.bit_depth == 16);
  CHECK(options.progress_interval_s == 0.125);
  CHECK(options.priority == -7);
}

TEST_CASE("what is left out has the contract's default") {
  const api::JobRequest request = api::parse_job(body_with_options("{}"));
  CHECK(request.scene.camera.up == Vec3{0, 1, 0});
  CHECK(request.scene.camera.projection == scene::Projection::perspective);
  CHECK_FALSE(request.scene.camera.lens);
  CHECK(request.scene.background == math::black);
  CHECK(request.scene.objects.empty());
  CHECK(request.options.width == 800);
  CHECK(request.options.shadow_samples == 64);
  CHECK(request.options.threads == scene::all_threads);
  CHECK(request.options.acceleration == scene::Acceleration::bvh);
  CHECK_FALSE(request.options.target_error);
}

TEST_CASE("integers are exact") {
  CHECK(api::parse_job(body_with_options(R"({"seed": 9007199254740993})")).options.seed == 9007199254740993u);
  CHECK(api::parse_job(body_with_options(R"({"seed": 1e15, "width": 3.0})")).options.seed == 1000000000000000u);
  CHECK_THROWS_AS(api::parse_job(body_with_options(R"({"seed": 18446744073709551616})")), api::InvalidBody);
}

TEST_CASE("an override wins over the body and is checked like it") {
  const std::string body = body_with_options(R"({"width": 0, "height": 5})");
  const scene::Options options =
      api::parse_job(body, {"width=7", "width=8", "format=exr", "acceleration=\"none\"", "target_error=0.5"}).options;
  CHECK(options.width == 8);
  CHECK(options.height == 5);
  CHECK(options.format == scene::ImageFormat::exr);
  CHECK(options.acceleration == scene::Acceleration::none);
  CHECK(options.target_error == 0.5);
  const auto pointers = [&](const std::vector<std::string>& overrides) {
    std::string found;
    try {
      api::parse_job(body_with_options("{}"), overrides);
    } catch (const api::InvalidBody& error) {
      CHECK(error.problem().status == 422);
      for (const api::FieldError& field : error.problem().errors) found += field.pointer + " ";
    }
    return found;
  };
  CHECK(pointers({"width=0"}) == "/options/width ");
  CHECK(pointers({"width=wide", "height=[1]", "colour=red"}) == "/options/width /options/height /options/colour ");
  CHECK(pointers({"width"}) == "/options/width ");
  CHECK(pointers({"format="}) == "/options/format ");
  CHECK(pointers({"width=", "=3"}) == "/options/width /options/ ");
}

TEST_CASE("an override works without options in the body") {
  const std::string body =
      R"({"scene": {"camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40}}})";
  CHECK(api::parse_job(body, {"width=9"}).options.width == 9);
}
