// Points side by side: what is found for all of them at once is what is found for each, and what they tell each other.
#include "engine/math/elementary.h"
#include "engine/render/camera.h"
#include "engine/shading/batch_terms.h"
#include "engine/shading/integrator.h"
#include "engine/shading/shadows/shared_samples.h"
#include "tests/robustness/worlds.h"
#include "tests/support/picture.h"
#include "tests/support/scenes.h"

using namespace penumbra;
using math::Vec3;
using shading::lane_count;
using shading::LaneMask;

namespace {

struct Points {
  shading::CompiledMaterial material;
  shading::PointBatch batch;
};

/// Sixteen points of a plane, one pixel apart, or on one side of column `edge` of a plane one unit below.
void add_square(Points& points, int edge = 4) {
  points.material.is_lit = true;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      shading::ShadingPoint at;
      at.surface.position = {static_cast<double>(column), static_cast<double>(row), column < edge ? 0.0 : -40.0};
      at.surface.normal = at.surface.shading_normal = at.facing = {0, 0, 1};
      at.material = &points.material;
      at.footprint = 1;
      points.batch.add(at, {column + 0.0, row + 0.0});
    }
  }
}

template <class Value>
std::array<shading::Visibility, lane_count> seen_by(const Points& points, double variance, const Value& value) {
  std::array<shading::Visibility, lane_count> seen;
  for (std::size_t lane = 0; lane < lane_count; ++lane)
    seen[lane] = {math::grey(value(points.batch.pixel(lane))), {math::grey(variance), math::grey(variance)}, false};
  return seen;
}

constexpr LaneMask all = 0xffff;

}  // namespace

TEST_CASE("sides, distances, cosines and discs of points side by side are those of each, to the last bit") {
  test::Random random(71);
  for (int i = 0; i < 200; ++i) {
    const double scale = std::ldexp(1.0, random.below(40) - 20) * (i % 10 == 0 ? 1e145 : 1);
    const Vec3 light = random.in_cube(3 * scale), along = random.direction();
    shading::CompiledMaterial material;
    shading::PointBatch points;
    std::vector<shading::ShadingPoint> each(lane_count);
    for (std::size_t k = 0; k < lane_count; ++k) {
      each[k].surface.position = random.in_cube(scale), each[k].material = &material;
      each[k].surface.shading_normal = random.direction(), each[k].facing = random.direction();
      each[k].view = random.direction();
      REQUIRE(points.add(each[k], {static_cast<double>(k % 4), static_cast<double>(k / 4)}) < lane_count);
    }
    shading::LightTerms terms, distant;
    find_terms(points, light, terms), find_terms_along(points, along, distant);
    shading::DiscBatch disc;
    disc.axis = terms.towards;
    set_half_axes(terms.l, 0.5 * scale, disc);
    const LaneMask above = whole_above_horizon(points, disc);
    sampling::DiscSpirals::Points places;
    sampling::DiscSpirals(2).points(0, sampling::DiscSpiral::turn(sampling::Key(7)), places);
    shading::Lanes3 ways;
    find_ways(disc, places, ways);
    for (std::size_t lane = 0; lane < lane_count; ++lane) {
      const shading::ShadingPoint& at = points.point(lane);
      const Vec3& n = at.surface.shading_normal;
      const Vec3 towards = light - at.surface.position;
      const double distance = math::length(towards);
      const Vec3 l = towards * (-1 / distance);
      CHECK(terms.towards[lane] == towards);
      CHECK(terms.distance[lane] == distance);
      CHECK(terms.l[lane] == l);
      CHECK((terms.facing >> lane & 1) == (dot(at.facing, towards) > 0 ? 1 : 0));
      CHECK((terms.in_front >> lane & 1) == (dot(at.facing, l) < 0 ? 1 : 0));
      CHECK((distant.facing >> lane & 1) == (dot(at.facing, -along) > 0 ? 1 : 0));
      for (const auto& [found, way] : {std::pair(&terms, l), {&distant, along}}) {
        CHECK(found->diffuse[lane] == std::fabs(dot(way, n)));
        CHECK(found->mirrored[lane] == -dot(at.view, way - n * (2 * dot(way, n))));
      }
      const math::Frame frame = math::frame_around(l);
      const Vec3 u = frame.u * (0.5 * scale), v = frame.v * (0.5 * scale);
      CHECK(disc.u[lane] == u);
      CHECK(disc.v[lane] == v);
      CHECK(ways[lane] == towards + u * places.x[lane] + v * places.y[lane]);
      // All of the disc's edge is above the horizon.
      bool is_above = true;
      for (int k = 0; k < 360; ++k) {
        const auto [sine, cosine] = math::sine_cosine_degrees(k);
        is_above = is_above && dot(at.facing, towards + u * cosine + v * sine) > -1e-12 * distance;
      }
      if ((above >> lane & 1) != 0) CHECK(is_above);
    }
  }
}

TEST_CASE("the points of all places together are spread well over the disc, those of the first round as well") {
  for (const int count : {2, 4, 8, 16}) {
    const sampling::DiscSpirals spirals(count);
    double worst_of_all = 0, worst_of_first = 0;
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
      const auto turn = sampling::DiscSpiral::turn(sampling::Key(seed));
      std::vector<std::pair<double, double>> points;
      for (std::size_t round = 0; round < spirals.count(); ++round) {
        sampling::DiscSpirals::Points some;
        spirals.points(round, turn, some);
        for (std::size_t k = 0; k < lane_count; ++k) points.emplace_back(some.x[k], some.y[k]);
      }
      const auto squared = [&](std::size_t size) {
        double sum = 0;
        for (int way = 0; way < 8; ++way) {
          const auto [sine, cosine] = math::sine_cosine_degrees(45 * way + 10);
          const auto beyond = std::count_if(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(size),
                                            [&](const auto& p) { return p.first * cosine + p.second * sine > 0.3; });
          // The share of the disc beyond a line at 0.3 of the radius: (acos d − d·√(1 − d²))/π.
          const double off = static_cast<double>(beyond) / static_cast<double>(size) - 0.3119189;
          sum += off * off / 8;
        }
        return sum;
      };
      for (const auto& [x, y] : points) REQUIRE(x * x + y * y <= 1);
      worst_of_all += squared(points.size()) / 50, worst_of_first += squared(lane_count) / 50;
    }
    // Independent points would have 0.215/N.
    CHECK(worst_of_first < 0.6 * 0.215 / lane_count);
    CHECK(worst_of_all < 0.3 * 0.215 / (lane_count * count));
  }
}

TEST_CASE("what varies little along a surface is told better by all points than by each") {
  test::Random random(72);
  Points points;
  add_square(points);
  const double noise = 0.1;
  double before = 0, after = 0, told = 0;
  for (int i = 0; i < 400; ++i) {
    const double c = random.between(0.4, 0.6), a = random.between(-0.04, 0.04), b = random.between(-0.04, 0.04);
    const auto truth = [&](const shading::PixelPlace& p) { return c + a * (p.x - 1.5) + b * (p.y - 1.5); };
    auto seen =
        seen_by(points, noise * noise / 3, [&](const auto& p) { return truth(p) + random.between(-noise, noise); });
    const auto squared = [&] {
      double sum = 0;
      for (std::size_t lane = 0; lane < lane_count; ++lane) {
        const double off = seen[lane].mean.r - truth(points.batch.pixel(lane));
        sum += off * off;
      }
      return sum;
    };
    before += squared();
    CHECK(shading::shadows::share_samples(points.batch, all, false, seen.data()) == lane_count);
    after += squared();
    for (const shading::Visibility& one : seen) told += one.variance.measured.r;
  }
  CHECK(after < 0.45 * before);  // a plane has 3 of 16 unknowns, and its misfit is told roughly
  CHECK(told > 0.7 * after);
  CHECK(told < 1.5 * after);
}

TEST_CASE("what rises evenly along a surface is left as it is, however little its samples tell") {
  Points points;
  add_square(points);
  for (const auto& [a, b] : {std::pair(0.1, 0.0), {0.0, -0.1}, {0.08, 0.05}}) {
    const auto slope = [&](const shading::PixelPlace& p) { return 0.5 + a * (p.x - 1.5) + b * (p.y - 1.5); };
    auto seen = seen_by(points, 0.01, slope);
    shading::shadows::share_samples(points.batch, all, false, seen.data());
    for (std::size_t lane = 0; lane < lane_count; ++lane)
      CHECK(seen[lane].mean.r == doctest::Approx(slope(points.batch.pixel(lane))).epsilon(1e-12));
  }
}

TEST_CASE("an edge that samples show sharply stays sharp") {
  Points points;
  add_square(points);
  const auto edge = [](const shading::PixelPlace& p) { return p.x + p.y < 2.5 ? 1.0 : 0.0; };
  auto seen = seen_by(points, 0, edge);
  shading::shadows::share_samples(points.batch, all, true, seen.data());
  for (std::size_t lane = 0; lane < lane_count; ++lane)
    CHECK(seen[lane].mean.r == doctest::Approx(edge(points.batch.pixel(lane))).epsilon(1e-12));
}

TEST_CASE("points of different surfaces, or of different squares of the picture, tell each other nothing") {
  test::Random random(73);
  Points points;
  add_square(points, 2);
  const auto value = [](const shading::PixelPlace& p) { return p.x < 2 ? 0.9 : 0.1; };
  auto seen = seen_by(points, 1,
                      [&](const auto& p) { return value(p) + (static_cast<int>(p.x + p.y) % 2 == 0 ? 0.05 : -0.05); });
  CHECK(shading::shadows::share_samples(points.batch, all, true, seen.data()) == lane_count);
  for (std::size_t lane = 0; lane < lane_count; ++lane)
    CHECK(seen[lane].mean.r == doctest::Approx(value(points.batch.pixel(lane))).epsilon(0.03));

  Points apart;
  apart.material.is_lit = true;
  for (int k = 0; k < 8; ++k) {
    shading::ShadingPoint at = points.batch.point(0);
    at.surface.position = {k + 2.0, 0, 0};
    at.material = &apart.material;
    apart.batch.add(at, {k + 2.0, 0});
  }
  apart.batch.fill_unused();
  auto lonely = seen_by(apart, 1, [](const auto& p) { return p.x < 4 ? 0.9 : 0.1; });
  CHECK(shading::shadows::share_samples(apart.batch, apart.batch.lit(), true, lonely.data()) == 4);
}

TEST_CASE("hard lights: points side by side are lit as each alone is, to the last bit") {
  for (const char* name : {"zoo", "cow", "hard-and-soft"}) {
    api::JobRequest job = name == std::string("zoo") ? test::zoo() : test::example(name);
    job.options.width = 45, job.options.height = 34, job.options.samples_per_pixel = 1;
    job.scene.lights = {
        scene::PointLight{{5, 8, 5}, math::grey(0.6), {1, 0.1, 0.01}},
        scene::SpotLight{{-5, 7, 5}, math::grey(0.5), {}, 0, math::normalize(Vec3{0.6, -1, -0.6}), 2.5, 50},
        scene::DirectionalLight{{-1, -2, -1}, math::grey(0.3)}};
    job.scene.camera.lens.reset();
    const render::Picture picture = test::render(job);
    const auto& film = picture.film;
    const shading::Scene scene = test::compiled(job.scene);
    const render::Camera camera(job.scene.camera, job.options.width, job.options.height);
    const std::function<bool()> never = [] { return false; };
    shading::Integrator alone(scene, {job.options.max_depth, job.options.min_contribution, camera.pixel_width(), {}},
                              never);
    const shading::DiscSampling sampling(4);
    for (int row = 0; row < job.options.height; ++row) {
      for (int column = 0; column < job.options.width; ++column) {
        const auto seen = alone.trace(camera.ray(column + 0.5, row + 0.5, {0, 0}), sampling, sampling::Key(1)).radiance;
        const float* rgb = &film->rgb[film->offset(column, row)];
        CHECK(rgb[0] == static_cast<float>(seen.r));
        CHECK(rgb[1] == static_cast<float>(seen.g));
        CHECK(rgb[2] == static_cast<float>(seen.b));
      }
    }
    CHECK(picture.stats.skipped.at("lights_facing_away") == alone.counters().lights_facing_away);
    CHECK(picture.stats.skipped.at("lights_without_effect") == alone.counters().lights_without_effect);
  }
}

TEST_CASE("four points side by side that see all of a light are enough to tell, and a single one is not") {
  // Nothing stands before the light, and a ray of each point says so.
  for (const int edge : {2, 1}) {
    api::JobRequest job =
        api::parse_job(R"({"scene": {"camera": {"position": [0, 0, 5], "look_at": [0, 0, 0], "vertical_fov": 10},
      "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 0, 1], "material": {"diffuse": 0.5}}],
      "lights": [{"type": "point", "position": [0, 0, 4], "intensity": 1, "radius": 0.5}]},
      "options": {"samples_per_pixel": 1, "shadow_samples": 4}})");
    job.options.width = job.options.height = edge;
    const render::Picture picture = test::render(job);
    const std::uint64_t points = static_cast<std::uint64_t>(edge) * static_cast<std::uint64_t>(edge);
    CHECK(picture.stats.rays.shadow == (points == 4 ? points : 4 * points));
    for (const float value : picture.film->rgb) CHECK(value > 0);
  }
}
