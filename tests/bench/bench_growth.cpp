// One surface in more and more triangles: build, render, memory.
// Usage: bench_growth TRIANGLES [--threads N] [--runs N] [--edge PIXELS] [--save FILE]      prints one line of JSON
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/output/encode.h"
#include "engine/render/render.h"
#include "tests/bench/workload.h"

namespace penumbra::bench {
namespace {

using math::Vec3;

/// A torus knot with bumps, on a grid of `around` × `across` quads.
Vec3 on_knot(double s, double t) {
  const auto middle = [](double a) {
    const double r = 1 + 0.38 * std::cos(3 * a);
    return Vec3{r * std::cos(2 * a), 0.45 * std::sin(3 * a), r * std::sin(2 * a)};
  };
  const double a = 2 * M_PI * s, b = 2 * M_PI * t;
  const math::Frame frame = math::frame_around(math::normalize(middle(a + 1e-4) - middle(a - 1e-4)));
  // A frame that turns with the knot, so that the surface closes.
  const Vec3 up = math::normalize(math::cross(frame.n, Vec3{std::cos(2 * a), 0, std::sin(2 * a)}));
  const Vec3 out = math::cross(up, frame.n);
  const double radius = 0.2 + 0.012 * std::sin(60 * a) * std::sin(7 * b);
  return middle(a) + (out * std::cos(b) + up * std::sin(b)) * radius;
}

scene::Mesh knot(std::size_t triangles) {
  const auto across = static_cast<std::uint32_t>(std::lround(std::sqrt(static_cast<double>(triangles) / 24)));
  const std::uint32_t around = static_cast<std::uint32_t>(triangles / 2) / across;
  scene::Mesh mesh;
  mesh.positions.reserve(static_cast<std::size_t>(around) * across);
  mesh.triangles.reserve(2 * static_cast<std::size_t>(around) * across);
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t j = 0; j < across; ++j) mesh.positions.push_back(on_knot(1.0 * i / around, 1.0 * j / across));
  }
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t j = 0; j < across; ++j) {
      const auto at = [&](std::uint32_t x, std::uint32_t y) { return x % around * across + y % across; };
      const std::uint32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
      mesh.triangles.push_back({a, c, b});
      mesh.triangles.push_back({a, d, c});
    }
  }
  return mesh;
}

scene::Description scene_of(std::size_t triangles) {
  scene::Description description;
  description.camera.position = {0, 2.6, 3.6};
  description.camera.direction = Vec3{0, -0.15, 0} - description.camera.position;
  description.camera.vertical_fov_degrees = 40;
  description.ambient = math::grey(0.1);
  description.materials.push_back(scene::default_material());
  description.objects.push_back({knot(triangles), {}});
  scene::Mesh floor;
  floor.positions = {{-6, -0.75, -6}, {-6, -0.75, 6}, {6, -0.75, 6}, {6, -0.75, -6}};
  floor.triangles = {{0, 1, 2}, {0, 2, 3}};
  description.objects.push_back({floor, {}});
  description.lights.push_back(scene::PointLight{{2, 4, 2}, math::grey(0.9), {}, 0.3});
  return description;
}

int bench(std::size_t triangles, int threads, int runs, int edge, const std::string& image) {
  const scene::Description description = scene_of(triangles);
  const std::size_t count = std::get<scene::Mesh>(description.objects[0].shape).triangles.size();
  scene::Options options;
  options.width = options.height = edge;
  options.threads = threads;
  system::Pool pool(threads);
  std::vector<double> build, render;
  for (int i = 0; i < runs; ++i) {
    render::Control control;
    const auto picture = render::render(description, options, pool, control);
    build.push_back(picture->stats.build_s), render.push_back(picture->stats.render_s);
    if (!image.empty()) std::ofstream(image, std::ios::binary) << output::encode(*picture->film, {});
  }
  const nlohmann::json line{{"triangles", count},
                            {"threads", threads},
                            {"edge", edge},
                            {"build_s", median(build)},
                            {"render_s", median(render)},
                            {"build_runs", build},
                            {"render_runs", render},
                            {"peak_bytes", peak_resident_bytes()}};
  std::printf("%s\n", line.dump().c_str());
  return 0;
}

}  // namespace
}  // namespace penumbra::bench

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: bench_growth TRIANGLES [option value]...\n"), 2;
  int threads = 2, runs = 3, edge = 800;
  std::string save;
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string name = argv[i], value = argv[i + 1];
    if (name == "--threads") threads = std::stoi(value);
    if (name == "--runs") runs = std::stoi(value);
    if (name == "--edge") edge = std::stoi(value);
    if (name == "--save") save = value;
  }
  return penumbra::bench::bench(std::stoul(argv[1]), threads, runs, edge, save);
}
