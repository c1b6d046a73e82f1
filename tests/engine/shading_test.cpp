// The light model of the contract's section 2, term by term, as scenes of one pixel.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include "engine/math/elementary.h"
#include "tests/support/picture.h"

using namespace penumbra;

namespace {

/// Red of the pixel that looks from (0, 0, 5) along −z at the objects.
double red(const std::string& scene, const std::string& options = "") {
  return test::render(
             api::parse_job(fmt::format(
                 R"({{"scene": {{"camera": {{"position": [0, 0, 5], "direction": [0, 0, -1], "view_plane": {{"width": 1e-9, "height": 1e-9, "distance": 1}}}}, {}}},
          "options": {{"width": 1, "height": 1{}}}}})",
                 scene, options)))
      .film->rgb[0];
}

std::string wall(const std::string& material, double z = 0) {
  return fmt::format(R"({{"type": "plane", "point": [0, 0, {}], "normal": [0, 0, 1], "material": {}}})", z, material);
}

}  // namespace

TEST_CASE("emission, ambient and background") {
  CHECK(red(R"("background": 0.25)") == 0.25);
  CHECK(red(fmt::format(R"("ambient": 0.5, "objects": [{}])", wall(R"({"ambient": 0.25, "emission": 2})"))) ==
        doctest::Approx(2.125));
}

TEST_CASE("diffuse, specular and attenuation of a point light") {
  const std::string light =
      R"("lights": [{"type": "point", "position": [3, 0, 4], "intensity": 6, "attenuation": [1, 0.5, 0.25]}])";
  const double received = 6 / (1 + 0.5 * 5 + 0.25 * 25);
  CHECK(red(fmt::format(R"("objects": [{}], {})", wall(R"({"diffuse": 0.5})"), light)) ==
        doctest::Approx(received * 0.5 * 0.8));
  // The light's mirror direction makes an angle with the view whose cosine is 0.8.
  CHECK(red(fmt::format(R"("objects": [{}], {})", wall(R"({"specular": 0.5, "shininess": 3})"), light)) ==
        doctest::Approx(received * 0.5 * 0.512));
  // A light behind the wall counts for nothing.
  CHECK(red(fmt::format(R"("objects": [{}], "lights": [{{"type": "point", "position": [0, 0, -1], "intensity": 1}}])",
                        wall(R"({"diffuse": 1})"))) == 0);
}

TEST_CASE("a spot falls off with its exponent and ends at its cutoff") {
  const auto lit = [](double exponent, double cutoff) {
    return red(
        fmt::format(R"("objects": [{}], "lights": [{{"type": "spot", "position": [0, 0, 2], "direction": [0, 0.6, -0.8],
                           "intensity": 1, "exponent": {}, "cutoff": {}}}])",
                    wall(R"({"diffuse": 1})"), exponent, cutoff));
  };
  CHECK(lit(1, 90) == doctest::Approx(0.8));
  CHECK(lit(2.5, 90) == doctest::Approx(std::pow(0.8, 2.5)));
  CHECK(lit(0, 90) == 1);
  CHECK(lit(1, 40) == doctest::Approx(0.8));
  CHECK(lit(1, 36) == 0);
}

TEST_CASE("shadows multiply the transmission of every surface crossed") {
  const std::string scene =
      R"("objects": [{}, {{"type": "sphere", "center": [4, 0, 4], "radius": 0.5, "material": {{"transmission": [0.5, 1, 1]}}}},
    {{"type": "triangle", "vertices": [[2, -9, 0], [2, 9, 0], [2, 0, 9]], "material": {}}}],
    "lights": [{{"type": "point", "position": [6, 0, 6], "intensity": 1}}])";
  const double open = std::sqrt(0.5);
  CHECK(red(fmt::format(fmt::runtime(scene), wall(R"({"diffuse": 1})"), R"({"transmission": 0.5})")) ==
        doctest::Approx(open * 0.25 * 0.5));
  CHECK(red(fmt::format(fmt::runtime(scene), wall(R"({"diffuse": 1})"), R"({"diffuse": 1})")) == 0);
}

TEST_CASE("reflection and transmission: depth, contribution, and what a missed ray returns") {
  const std::string mirrors =
      fmt::format(R"("background": 1, "objects": [{}, {}])", wall(R"({"reflection": 0.5, "emission": 1})"),
                  wall(R"({"reflection": 0.5, "emission": 1})", 6));
  for (const int depth : {0, 1, 2, 5}) {
    double expected = 0;
    for (int i = 0; i <= depth; ++i) expected += std::pow(0.5, i);
    CHECK(red(mirrors, fmt::format(R"(, "max_depth": {})", depth)) == doctest::Approx(expected));
  }
  // 0.5³ is above 0.1, 0.5⁴ below: three bounces.
  CHECK(red(mirrors, R"(, "min_contribution": 0.1)") == doctest::Approx(1.875));
  CHECK(red(fmt::format(R"("background": 0.75, "objects": [{}])", wall(R"({"transmission": 0.5})"))) ==
        doctest::Approx(0.375));
}

TEST_CASE("what glows alone and what is lit stand side by side") {
  std::string strips;
  for (int i = 0; i < 16; ++i) {
    strips += fmt::format(
        R"({0}{{"type": "polygon", "vertices": [[{1}, -8, 0], [{2}, -8, 0], [{2}, 8, 0], [{1}, 8, 0]], "material": {{"{3}}}}})",
        i > 0 ? ", " : "", i - 8, i - 7, i % 3 == 0 ? R"(emission": 0.25)" : R"(diffuse": 1)");
  }
  const auto picture = test::render(api::parse_job(fmt::format(
      R"({{"scene": {{"camera": {{"position": [0, 0, 5], "direction": [0, 0, -1], "projection": "orthographic", "view_plane": {{"width": 16, "height": 16}}}},
          "objects": [{}], "lights": [{{"type": "directional", "direction": [0, 0, -1], "intensity": 1}}]}},
          "options": {{"width": 16, "height": 16}}}})",
      strips)));
  for (std::size_t pixel = 0; pixel < 256; ++pixel)
    CHECK(picture.film->rgb[3 * pixel] == (pixel % 16 % 3 == 0 ? 0.25 : 1));
}

TEST_CASE("rays that would add too little are counted, not cast") {
  const auto picture = test::render(api::parse_job(
      R"({"scene": {"background": 1, "camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 1},
          "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 0, 1], "material": {"reflection": 0.5, "transmission": 0.05}}]},
          "options": {"width": 3, "height": 2, "min_contribution": 0.1}})"));
  CHECK(picture.stats.rays.camera == 6);
  CHECK(picture.stats.rays.reflection == 6);
  CHECK(picture.stats.rays.transmission == 0);
  CHECK(picture.stats.skipped.at("negligible_rays") == 6);
}

TEST_CASE("Snell's law through a slab shifts the ray; past the critical angle everything is reflected") {
  // A ray at 45° enters glass of ior √2 and runs on at 30°: it meets the far side's emissive strip or not.
  const auto seen = [](double from, double to) {
    return test::render(
               api::parse_job(fmt::format(
                   R"({{"scene": {{"camera": {{"position": [-1, 0, 1], "direction": [1, 0, -1], "view_plane": {{"width": 1e-9, "height": 1e-9, "distance": 1}}}},
        "objects": [{{"type": "plane", "point": [0, 0, 0], "normal": [0, 0, 1], "material": {{"transmission": 1, "ior": {}}}}},
                    {{"type": "polygon", "vertices": [[{}, -1, -1], [{}, -1, -1], [{}, 1, -1], [{}, 1, -1]], "material": {{"emission": 1}}}}]}},
        "options": {{"width": 1, "height": 1}}}})",
                   std::sqrt(2.0), from, to, to, from)))
        .film->rgb[0];
  };
  const double across = std::tan(math::pi / 6);
  CHECK(seen(across - 1e-6, across + 1e-6) == 1);
  CHECK(seen(across + 1e-6, across + 1) == 0);
  // From inside a glass ball, beyond the critical angle: the transmitted share follows the reflected ray, back to the
  // glow.
  const double glow = test::render(api::parse_job(R"({"scene": {"background": 0,
      "camera": {"position": [0.9, 0, 0], "direction": [0, 0, -1], "view_plane": {"width": 1e-9, "height": 1e-9, "distance": 1}},
      "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": {"transmission": 0.5, "ior": 1.5, "emission": 1}}]},
      "options": {"width": 1, "height": 1, "max_depth": 3}})"))
                          .film->rgb[0];
  CHECK(glow == doctest::Approx(1.875));
}

TEST_CASE("smooth normals shade, geometric ones decide the side") {
  const auto lit = [](const std::string& light) {
    return red(fmt::format(R"("objects": [{{"type": "mesh", "positions": [-9,-9,0, 9,-9,0, 0,9,0], "indices": [0,1,2],
      "normals": [0.6,0,0.8, 0.6,0,0.8, 0.6,0,0.8], "material": {{"diffuse": 1}}}}],
      "lights": [{{"type": "directional", "direction": {}, "intensity": 1}}])",
                           light));
  };
  CHECK(lit("[0, 0, -1]") == doctest::Approx(0.8));
  CHECK(lit("[-0.6, 0, -0.8]") == doctest::Approx(1));
  CHECK(lit("[-1, 0, 0.01]") == 0);
}

TEST_CASE("what stands close to a surface hides a light however far that is") {
  for (const double far : {1e3, 1e9, 1e12}) {
    for (const double radius : {0.0, 1e-4 * far}) {
      const double lit = red(fmt::format(
          R"("objects": [{}, {{"type": "polygon", "vertices": [[0.02, -1, 0.03], [1, -1, 0.03], [1, 1, 0.03], [0.02, 1, 0.03]]}}],
             "lights": [{{"type": "point", "position": [{}, 0, {}], "intensity": 1, "radius": {}}}])",
          wall(R"({"diffuse": 1})"), far, far, radius));
      CHECK(lit == 0);
    }
  }
}

TEST_CASE("a squashed shape behind a soft light hides none of it") {
  for (const char* shape :
       {R"("type": "sphere", "center": [1.16, 0, 3.45], "radius": 0.5)",
        R"("type": "cylinder", "point": [1.16, 0, 3.2], "direction": [0, 0, 1], "radius": 0.3, "height": 0.5)"}) {
    const double lit = red(fmt::format(
        R"("objects": [{}, {{"type": "group", "transform": [10,0,0,0, 0,10,0,0, 0,0,1,0, 0,0,0,1], "objects": [{{{}}}]}}],
           "lights": [{{"type": "point", "position": [5, 0, 5], "intensity": 1, "radius": 3}}])",
        wall(R"({"diffuse": 1})"), shape));
    CHECK(lit == doctest::Approx(std::sqrt(0.5)));
  }
}

TEST_CASE("a lamp that is shown does not shade itself: a ball that glows, a panel in a wide ceiling") {
  const auto with = [](const std::string& light, const std::string& lamp) {
    return red(fmt::format(R"("objects": [{}{}], "lights": [{}])", wall(R"({"diffuse": 1})"), lamp, light));
  };
  const std::string ball = R"({"type": "sphere", "center": [3, 1, 4], "radius": 0.7, "intensity": 1})";
  CHECK(with(ball, R"(, {"type": "sphere", "center": [3, 1, 4], "radius": 0.7, "material": {"emission": 1}})") ==
        with(ball, ""));
  // A placed one is not known for the lamp, and sampled.
  CHECK(with(ball, R"(, {"type": "group", "transform": [1,0,0,0, 0,1,0,0, 0,0,1,0, 3,1,4,1], "objects": [
               {"type": "sphere", "center": [0, 0, 0], "radius": 0.7, "material": {"emission": 1}}]})") ==
        doctest::Approx(with(ball, "")));
  const std::string panel =
      R"({"type": "rectangle", "corner": [9.5, -0.5, 6], "edge_u": [0, 1, 0], "edge_v": [1, 0, 0], "intensity": 9})";
  CHECK(
      with(panel,
           R"(, {"type": "polygon", "vertices": [[-2e3, -3e3, 6], [3e3, -2e3, 6], [2e3, 3e3, 6], [-3e3, 2e3, 6]]})") ==
      doctest::Approx(with(panel, "")));
}

TEST_CASE("a lamp's own light does not fall on its outside, nor a panel's on its back") {
  const auto brightest = [](const std::string& scene) {
    const auto picture = test::render(api::parse_job(fmt::format(
        R"({{"scene": {{"camera": {{"position": [0.3, 6.4, 5], "look_at": [0.1, 0.2, 0.3], "vertical_fov": 40}}, {}}},
            "options": {{"width": 64, "height": 64}}}})",
        scene)));
    return *std::ranges::max_element(picture.film->rgb);
  };
  CHECK(
      brightest(
          R"("objects": [{"type": "sphere", "center": [0.1, 0.2, 0.3], "radius": 1.1, "material": {"diffuse": 0.8, "specular": 1}}],
      "lights": [{"type": "sphere", "center": [0.1, 0.2, 0.3], "radius": 1.1, "intensity": 1}])") == 0);
  for (const double height : {2.4, 2.5, 2.7}) {
    CHECK(
        brightest(fmt::format(
            R"("objects": [{{"type": "polygon", "vertices": [[-3, {0}, -3], [-3, {0}, 3], [3, {0}, 3], [3, {0}, -3]]}}],
      "lights": [{{"type": "rectangle", "corner": [-0.5, {0}, -0.5], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1], "intensity": 5}}])",
            height)) == 0);
  }
  CHECK(
      brightest(
          R"("objects": [{"type": "polygon", "vertices": [[0, 0, 0], [0.921061, 0.389418, 0], [0.921061, 0.389418, 1], [0, 0, 1]]}],
      "lights": [{"type": "rectangle", "corner": [0, 0, 0], "edge_u": [0.921061, 0.389418, 0], "edge_v": [0, 0, 1], "intensity": 1}])") ==
      0);
}

TEST_CASE("a panel without end lights a slope, and a ball hides its share, the more exactly the more samples") {
  const auto with = [](double tilt_degrees, const std::string& material, const std::string& objects, int samples) {
    const auto [sine, cosine] = math::sine_cosine_degrees(tilt_degrees);
    return red(
        fmt::format(R"("objects": [{{"type": "plane", "point": [0, 0, 0], "normal": [{}, 0, {}], "material": {}}}{}],
        "lights": [{{"type": "rectangle", "corner": [-1e8, -1e8, 7], "edge_u": [0, 2e8, 0], "edge_v": [2e8, 0, 0], "intensity": 1}}])",
                    sine, cosine, material, objects),
        fmt::format(R"(, "shadow_samples": {})", samples));
  };
  for (const int samples : {16, 64, 1024, 4096}) {
    const double error = 0.5 * std::pow(samples, -0.75);
    for (const double tilt : {0.0, 20.0, 60.0}) {
      const auto [sine, cosine] = math::sine_cosine_degrees(tilt);
      CHECK(with(tilt, R"({"diffuse": 1})", "", samples) == doctest::Approx((1 + cosine) / 2).epsilon(1e-6));
      // A surface that shines evenly measures the solid angle: a lune.
      CHECK(std::fabs(with(tilt, R"({"specular": 1})", "", samples) - 2 * (1 - tilt / 180)) < 3 * error);
    }
    const std::string ball = R"(, {"type": "sphere", "center": [0, 0, 6], "radius": 0.6})";
    CHECK(std::fabs(with(0, R"({"diffuse": 1})", ball, samples) - (1 - 0.01)) < error);
  }
}

TEST_CASE("light of one color is told as exactly as light of another, and takes as many samples") {
  const auto render = [](const char* color, double height) {
    return test::render(
               api::parse_job(fmt::format(
                   R"({{"scene": {{"camera": {{"position": [0, 0, 5], "look_at": [0, 0, 0], "vertical_fov": 20}},
          "objects": [{{"type": "plane", "point": [0, 0, 0], "normal": [0, 0, 1], "material": {{"diffuse": 0.6, "specular": 0.3}}}},
            {{"type": "sphere", "center": [0.3, 0, {}], "radius": 0.2}}],
          "lights": [{{"type": "rectangle", "corner": [-1, -1, 6], "edge_u": [0, 2, 0], "edge_v": [2, 0, 0], "intensity": {}}}]}},
          "options": {{"width": 12, "height": 12, "samples_per_pixel": 4, "shadow_samples": 256, "target_error": 0.004}}}})",
                   height, color)))
        .stats;
  };
  // A ball before the light, and one behind it, where all samples agree.
  for (const double height : {1.0, 20.0}) {
    const render::Stats red = render("[2, 0, 0]", height);
    CHECK(red.estimated_error > 0);
    for (const char* color : {"[0, 2, 0]", "[0, 0, 2]"}) {
      const render::Stats other = render(color, height);
      CHECK(other.estimated_error == red.estimated_error);
      CHECK(other.rays.camera == red.rays.camera);
    }
  }
}

TEST_CASE("a sphere light from inside, on its surface, just outside and far away") {
  const auto lit = [](double height, const std::string& material) {
    return red(fmt::format(
        R"("objects": [{}], "lights": [{{"type": "sphere", "center": [0, 0, {:.17}], "radius": 1, "intensity": 1}}])",
        wall(material), height));
  };
  for (const double height : {-0.9, 0.0, 0.5, 1 - 1e-12, 1.0, 1 + 0x1p-52, 1 + 1e-12, 1.001, 3.0, 1e3, 1e8}) {
    INFO("height ", height);
    const double h = std::max(1.0, height);
    CHECK(lit(height, R"({"diffuse": 1})") == doctest::Approx(1 / (h * h)).epsilon(1e-6));
    const double cosine = std::sqrt((h - 1) * (h + 1)) / h, cap = 2 / (h * h * (1 + cosine));
    CHECK(lit(height, R"({"specular": 1})") == doctest::Approx(cap).epsilon(height < 1 ? 0.02 : 1e-6));
  }
}

TEST_CASE("a skewed lamp that stands on the floor lights it without speckles") {
  api::JobRequest job =
      api::parse_job(R"({"scene": {"camera": {"position": [0, 2, 4], "look_at": [0, 0, 0], "vertical_fov": 40},
    "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": {"diffuse": 0.8}}],
    "lights": [{"type": "rectangle", "corner": [-0.5, 0, 0], "edge_u": [1, 0, 0], "edge_v": [-0.3, 1, 0], "intensity": 0.5}]},
    "options": {"width": 48, "height": 48, "transfer": "linear"}})");
  const auto quick = test::render(job).film;
  job.options.shadow_samples = 4096, job.options.seed = 7;
  const auto truth = test::render(job).film;
  CHECK(test::rmse(quick->rgb, truth->rgb) < 1.5e-3);  // by equal areas it was 3.2e-3
}

TEST_CASE("a smooth mesh shades alike as an instance and in a group") {
  const auto picture = [](const std::string& meshes, const std::string& object) {
    return test::render(
               api::parse_job(fmt::format(
                   R"({{"scene": {{"camera": {{"position": [0, 0, 3], "look_at": [0, 0, 0], "vertical_fov": 25}}, {}
          "objects": [{}], "lights": [{{"type": "directional", "direction": [1, -0.5, -1], "intensity": 1}}]}},
          "options": {{"width": 24, "height": 24}}}})",
                   meshes, object)))
        .film->rgb;
  };
  const std::string mesh =
      R"("positions": [0, 0, 0, 1, 0, 0, 0, 1, 0], "indices": [0, 1, 2], "normals": [0, 0, 1, 1, 0, 0.2, 0, 1, 1])";
  const std::string transform = R"("transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0.2, 0, -0.3, -0.3, 0, 1])";
  const auto instance = picture(fmt::format(R"("meshes": {{"m": {{{}}}}},)", mesh),
                                fmt::format(R"({{"type": "instance", "mesh": "m", {}}})", transform));
  const auto group =
      picture("", fmt::format(R"({{"type": "group", {}, "objects": [{{"type": "mesh", {}}}]}})", transform, mesh));
  CHECK(test::rmse(instance, group) < 1e-6);
  CHECK(*std::ranges::max_element(instance) > 0.1F);
}

TEST_CASE("a normal of no length is the triangle's own at that corner") {
  // Two triangles with a crease; all smooth but for one end of the edge between them. Of the other mesh that end has
  // the two triangles' own normals, and each triangle its own vertex there.
  const std::string crease = R"("positions": [-1,-1,0, 1,-1,0, 0,1,0, 1,1,-0.5], "indices": [0,1,2, 2,1,3],
      "normals": [-1,0,1, {}, 0,1,1, 1,0.5,1])";
  const std::string split = R"("positions": [-1,-1,0, 1,-1,0, 0,1,0, 1,1,-0.5, 1,-1,0], "indices": [0,1,2, 2,4,3],
      "normals": [-1,0,1, 0,0,3, 0,1,1, 1,0.5,1, 1,0.5,2])";
  const auto picture = [](const std::string& mesh, const std::string& transform, bool as_instance,
                          const std::string& acceleration, bool without) {
    const std::string object =
        as_instance ? fmt::format(R"({{"type": "instance", "mesh": "m", "transform": {}}})", transform)
                    : fmt::format(R"({{"type": "group", "transform": {}, "objects": [{{"type": "mesh", {}}}]}})",
                                  transform, mesh);
    api::JobRequest job = api::parse_job(fmt::format(
        R"({{"scene": {{"camera": {{"position": [0, 0, 6], "look_at": [0, 0, 0], "vertical_fov": 30}}, "meshes": {{"m": {{{}}}}},
          "objects": [{}], "lights": [{{"type": "directional", "direction": [1, -0.5, -1], "intensity": 1, "angular_radius": 1}}]}},
          "options": {{"width": 24, "height": 24, "acceleration": "{}"}}}})",
        mesh, object, acceleration));
    const auto clear = [](scene::Mesh& m) { m.normals.at(1) = {}; };
    if (without) clear(job.scene.meshes.front());
    if (auto* group = std::get_if<scene::Group>(&job.scene.objects.front().shape); without && group != nullptr)
      clear(std::get<scene::Mesh>(group->objects.front().shape));
    return test::render(job).film->rgb;
  };
  for (const char* transform : {"[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]", "[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]",
                                "[1,0.2,0.3,0, 0.4,0.7,0,0, 0.5,0,0.3,0, 0.1,0,0,1]"}) {
    for (const bool as_instance : {false, true}) {
      for (const char* acceleration : {"bvh", "groups"}) {
        INFO(transform, as_instance ? ", instance, " : ", group, ", acceleration);
        const auto zero =
            picture(fmt::format(fmt::runtime(crease), "0,0,1"), transform, as_instance, acceleration, true);
        CHECK(test::rmse(zero, picture(split, transform, as_instance, acceleration, false)) < 1e-6);
        CHECK(*std::ranges::max_element(zero) > 0.1F);
        const auto other = fmt::format(fmt::runtime(crease), "0,0,1");
        CHECK(test::rmse(zero, picture(other, transform, as_instance, acceleration, false)) > 1e-3);
      }
    }
  }
}

TEST_CASE("any ratio of refraction lets a ray straight on that comes along the normal") {
  for (const char* ior : {"1e-20", "1e20", "1.5"}) {
    CHECK(red(fmt::format(R"("objects": [{}, {}])", wall(fmt::format(R"({{"transmission": 1, "ior": {}}})", ior)),
                          wall(R"({"emission": 1})", -1))) == 1);
  }
}
