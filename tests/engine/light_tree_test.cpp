// Many lights: bounds on what they add hold for each of them, and what a choice leaves out adds no more than it says.
#include "engine/shading/light_tree.h"

#include <doctest/doctest.h>

#include "engine/math/elementary.h"
#include "tests/robustness/worlds.h"

using namespace penumbra;
using math::Color;
using math::Vec3;
using shading::LightReach;

namespace {

/// A point of a surface that light reaches, and its material.
struct Point {
  shading::CompiledMaterial material;
  shading::ShadingPoint at;
};

std::vector<Point> random_points(test::Random& random, const Vec3& middle, double reach) {
  std::vector<Point> points(static_cast<std::size_t>(1 + random.below(16)));
  const Vec3 normal = random.direction();
  const double curved = random.below(2) * random.between(0, 1), smooth = random.below(2) * random.between(0, 0.3);
  for (Point& point : points) {
    point.at.surface.position = middle + random.in_cube(reach);
    point.at.facing = math::normalize(normal + random.in_cube(curved));
    point.at.surface.shading_normal = math::normalize(point.at.facing + random.in_cube(smooth));
    point.at.view = random.direction();
    point.material.diffuse = {random.between(0, 1), random.between(0, 1), 0};
    if (random.below(2) == 0) point.material.specular = {0, random.between(0, 1), random.between(0, 1)};
    point.material.shininess = random.below(3) == 0 ? 0 : std::exp(random.between(0, 6));
  }
  for (Point& point : points) point.at.material = &point.material;
  return points;
}

shading::LitRegion around(const std::vector<Point>& points) {
  shading::LitRegion region;
  for (const Point& point : points) region.add(point.at, math::white);
  return region;
}

shading::Light random_light(test::Random& random, const Vec3& middle, double reach) {
  const Vec3 position = middle + random.in_cube(reach);
  const Color intensity{random.between(0, 2), random.between(0, 2), random.between(0, 2)};
  const scene::Attenuation attenuation{random.between(0, 1), random.between(0, 1), random.between(0, 2)};
  switch (random.below(5)) {
    case 0:
      return shading::RectangleLight{position, {0.3, 0, 0}, {0, 0, 0.2}, {0, -1, 0}, intensity};
    case 1:
      return shading::SphereLight{position, random.between(0.01, 0.3), intensity};
    case 2:
      return shading::DiscLight{position, intensity, attenuation, 0.1, false, {}, 0, 0};
    default:
      return shading::DiscLight{position,
                                intensity,
                                attenuation,
                                0.1,
                                true,
                                random.direction(),
                                random.below(3) * random.between(0, 9),
                                math::sine_cosine_degrees(random.below(4) == 0 ? 90 : random.between(1, 180)).cosine};
  }
}

/// The contract's diffuse·|n·l| + specular·max(0, −v·r)^shininess on the viewer's side.
Color sent(const shading::ShadingPoint& at, const Vec3& l) {
  if (!(math::dot(at.facing, l) < 0)) return {};
  const Vec3& n = at.surface.shading_normal;
  const Vec3 r = l - n * (2 * math::dot(l, n));
  const double along = std::max(0.0, -math::dot(at.view, r));
  return at.material->diffuse * std::fabs(math::dot(n, l)) +
         at.material->specular * std::pow(std::min(1.0, along), at.material->shininess);
}

Color plain(const shading::DiscLight& light, const shading::ShadingPoint& at) {
  const Vec3 way = at.surface.position - light.position;
  const double d = math::length(way), along = math::dot(light.direction, way) / d;
  if (light.is_spot && along < light.cutoff_cosine) return {};
  const double strength = light.is_spot ? std::pow(std::max(0.0, along), light.exponent) : 1;
  const auto& [constant, linear, quadratic] = light.attenuation;
  return light.intensity * sent(at, way * (1 / d)) * (strength / (constant + linear * d + quadratic * d * d));
}
Color plain(const shading::DistantLight& light, const shading::ShadingPoint& at) {
  return light.intensity * sent(at, light.direction);
}
/// Of small pieces.
Color plain(const shading::RectangleLight& light, const shading::ShadingPoint& at) {
  constexpr int n = 24;
  const double area = math::length(math::cross(light.edge_u, light.edge_v)) / (n * n);
  Color sum;
  for (int i = 0; i < n * n; ++i) {
    const Vec3 way =
        at.surface.position - (light.corner + light.edge_u * ((i % n + 0.5) / n) + light.edge_v * ((i / n + 0.5) / n));
    const double d = math::length(way), side = math::dot(light.normal, way) / d;
    if (side > 0) sum += sent(at, way * (1 / d)) * (side * area / (d * d * math::pi));
  }
  return light.radiance * sum;
}
Color plain(const shading::SphereLight& light, const shading::ShadingPoint& at) {
  constexpr int n = 24;
  const Vec3 axis = light.center - at.surface.position;
  const double sine = light.radius / math::length(axis), cosine = sine < 1 ? std::sqrt(1 - sine * sine) : -1;
  const math::Frame frame = math::frame_around(math::normalize(axis));
  Color sum;
  for (int i = 0; i < n * n; ++i) {
    const double z = 1 - (1 - cosine) * (i % n + 0.5) / n, angle = 2 * math::pi * (i / n + 0.5) / n;
    const double across = std::sqrt(std::max(0.0, 1 - z * z));
    const Vec3 to = frame.n * z + (frame.u * std::cos(angle) + frame.v * std::sin(angle)) * across;
    sum += sent(at, -to) * (2 * (1 - cosine) / (n * n));
  }
  return light.radiance * sum;
}
Color plain(const shading::Light& light, const shading::ShadingPoint& at) {
  return std::visit([&](const auto& l) { return plain(l, at); }, light);
}

}  // namespace

TEST_CASE("no light adds more than its bounds say, nor several together, and what may light nothing does not") {
  test::Random random(81);
  int dark = 0, bounded = 0;
  for (int i = 0; i < 20'000; ++i) {
    const double reach = std::exp(random.between(-6, 1));
    const std::vector<Point> points = random_points(random, random.in_cube(2), reach);
    const shading::LitRegion region = around(points);
    std::vector<shading::Light> lights;
    LightReach together;
    const Vec3 middle = random.in_cube(3);
    for (int k = i % 4 == 0 ? 3 : 1; k > 0; --k) {
      lights.push_back(random_light(random, middle, random.between(0, 1)));
      together.include(*reach_of(lights.back()));
    }
    const double most = together.most(region);
    const bool may_light = together.may_light(region);
    dark += may_light ? 0 : 1, bounded += most < 0.1 ? 1 : 0;
    for (const Point& point : points) {
      Color sum;
      for (const shading::Light& light : lights) sum += plain(light, point.at);
      CHECK(math::max_channel(sum) <= most * (1 + 1e-9));
      if (!may_light) CHECK(math::is_black(sum));
    }
    for (const shading::Light& light : lights) {
      if (together.lights_for_certain(region)) CHECK(reach_of(light)->may_light(region));
    }
  }
  CHECK(dark > 3000);
  CHECK(bounded > 3000);
}

TEST_CASE("of one small light and one point the bounds are what the light adds") {
  test::Random random(82);
  int lit = 0;
  for (int i = 0; i < 2000; ++i) {
    std::vector<Point> points = random_points(random, {}, 0.01);
    points.resize(1);
    points[0].at.material = &points[0].material;
    points[0].material.diffuse = math::grey(0.5), points[0].material.specular = math::grey(0.5);
    const shading::Light light = random_light(random, {0, 2, 0}, 1);
    if (!std::holds_alternative<shading::DiscLight>(light)) continue;
    const double adds = math::max_channel(plain(light, points[0].at));
    const LightReach bounds = *reach_of(light);
    CHECK(bounds.may_light(around(points)) == (adds > 0));
    if (adds > 0) CHECK(bounds.most(around(points)) == doctest::Approx(adds).epsilon(1e-6));
    lit += adds > 0 ? 1 : 0;
  }
  CHECK(lit > 200);
}

TEST_CASE("a choice of lights is all that may light its points, or stands for it within the error allowed") {
  test::Random random(83);
  std::vector<shading::Light> lights;
  for (int k = 0; k < 400; ++k) lights.push_back(random_light(random, {0, 2, 0}, 20));
  for (const std::size_t at : {7, 80, 399}) lights[at] = shading::DistantLight{{0, -1, 0}, math::white};
  const shading::LightTree tree(lights);
  shading::LightChoice choice;
  std::size_t unseen = 0;
  for (int i = 0; i < 60; ++i) {
    const std::vector<Point> points = random_points(random, random.in_cube(20), 0.1);
    const shading::LitRegion region = around(points);
    const double error = i % 3 == 0 ? 0 : std::exp(random.between(-9, 0));
    std::vector<std::array<Color, 400>> adds(points.size());
    for (std::size_t p = 0; p < points.size(); ++p) {
      for (std::size_t k = 0; k < lights.size(); ++k) adds[p][k] = plain(lights[k], points[p].at);
    }
    constexpr int draws = 200;
    std::vector<Color> mean(points.size()), squares(points.size()), truth(points.size());
    for (int draw = 0; draw < draws; ++draw) {
      choice.take(tree, region, error, sampling::Key(static_cast<std::uint64_t>(1000 * i + draw)));
      std::size_t count = 0, last = 0;
      std::vector<bool> is_taken(lights.size());
      choice.for_each([&](std::size_t light) {
        CHECK((count == 0 || light > last));
        is_taken[light] = true, last = light, ++count;
        return true;
      });
      CHECK(choice.drawn().size() % 2 == 0);
      CHECK(count + choice.culled() + choice.unseen() + choice.drawn().size() == lights.size());
      unseen += choice.unseen();
      for (std::size_t p = 0; p < points.size(); ++p) {
        Color sum, all;
        for (std::size_t k = 0; k < lights.size(); ++k) {
          all += adds[p][k];
          if (is_taken[k]) sum += adds[p][k];
        }
        for (const auto& [light, times] : choice.drawn()) {
          CHECK(!is_taken[light]);
          sum += adds[p][light] * times;
        }
        if (error == 0) CHECK(sum == all);
        truth[p] = all, mean[p] += sum * (1.0 / draws), squares[p] += (sum - all) * (sum - all) * (1.0 / draws);
      }
    }
    for (std::size_t p = 0; p < points.size(); ++p) {
      const Color off = mean[p] - truth[p];
      // The mean of independent draws, four standard errors away at most; the error itself with a tenth for chance.
      CHECK(math::max_channel(squares[p]) <= 1.1 * error * error + 1e-24);
      CHECK(math::max_channel(off * off) <= 16 * error * error / draws + 1e-24);
    }
  }
  CHECK(unseen > 40 * 200 * 100);
  choice.take_all(lights.size());
  std::size_t count = 0;
  choice.for_each([&](std::size_t light) { return light == count++; });
  CHECK(count == lights.size());
}
