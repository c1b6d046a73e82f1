// Points of a scene's picture and its lights: whatever the engine calls lit or dark for certain is checked with rays.
// Usage: bench_points SCENE.json [--edge PIXELS] [--grid POINTS] [--rays N]    prints one line of JSON; 1 if any is
// wrong
#include <cmath>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "engine/accel/queries.h"
#include "engine/math/error_free.h"
#include "engine/render/camera.h"
#include "engine/shading/shadows/shadows.h"
#include "tests/bench/workload.h"

namespace penumbra::bench {
namespace {

struct Counts {
  std::uint64_t lit = 0, dark = 0, partial = 0, wrong = 0;
};

/// The disc as the integrator sees it from a point: of one light or of directions.
struct Disc {
  shading::shadows::SeenDisc seen;
  shading::shadows::Target target;
};

std::optional<Disc> disc_of(const shading::Light& light, const math::Vec3& from) {
  const auto around = [](const math::Vec3& axis, double radius, const shading::shadows::Target& target) {
    return Disc{{axis, math::normalize(axis), radius, target.is_infinite}, target};
  };
  if (const auto* disc = std::get_if<shading::DiscLight>(&light); disc != nullptr && disc->radius > 0)
    return around(disc->position - from, disc->radius, {disc->position, disc->radius});
  if (const auto* distant = std::get_if<shading::DistantLight>(&light); distant != nullptr && distant->tangent > 0)
    return around(-distant->direction, distant->tangent, {-distant->direction, distant->tangent, true});
  return std::nullopt;
}

shading::ShadingPoint shading_point(const shading::Scene& scene, const geometry::Ray& ray, const accel::Hit& hit,
                                    const shading::PixelWidth& pixel) {
  shading::ShadingPoint at;
  at.surface = accel::surface_at(scene.world, ray, hit);
  at.id = hit.surface;
  at.material = &scene.materials[scene.item_material[hit.surface.item]];
  at.view = ray.direction;
  at.facing = math::dot(at.surface.normal, ray.direction) > 0 ? -at.surface.normal : at.surface.normal;
  at.footprint = pixel.at_camera + pixel.per_distance * hit.t;
  return at;
}

int bench(const std::string& path, int edge, int grid, int rays) {
  const api::JobRequest job = load_job(path);
  system::Pool pool(static_cast<int>(std::thread::hardware_concurrency()));
  const render::Compiled compiled = compile_with(job.scene, pool);
  const shading::Scene& scene = compiled.scene;
  const render::Camera camera(job.scene.camera, edge, edge);
  const shading::PixelWidth pixel = camera.pixel_width();
  const shading::Switches all;
  shading::Switches none;
  none.shadow_candidates = none.light_cells = false;
  Counts counts;
  std::mutex mutex;
  pool.run(grid, pool.size(), [&](std::int64_t row) {
    shading::Counters counters;
    const std::function<bool()> never = [] { return false; };
    shading::shadows::Shadows classifies(scene, all, counters, never), casts(scene, none, counters, never);
    const shading::DiscSampling few(64), many(rays);
    Counts here;
    for (int column = 0; column < grid; ++column) {
      const double step = static_cast<double>(edge) / grid;
      const geometry::Ray ray = camera.ray((column + 0.5) * step, (static_cast<double>(row) + 0.5) * step, {0, 0});
      const auto hit = accel::closest_hit(scene.world, ray);
      if (!hit) continue;
      const shading::ShadingPoint at = shading_point(scene, ray, *hit, pixel);
      for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        const std::optional<Disc> disc = disc_of(scene.lights[i], at.surface.position);
        if (!disc || !(math::dot(at.facing, disc->seen.axis) > 0)) continue;
        const sampling::Key key = sampling::Key(1).at(static_cast<std::uint64_t>(row * grid + column));
        const auto visibility = [&](shading::shadows::Shadows& shadows, const shading::DiscSampling& samples) {
          shading::shadows::Sight sight = shadows.aim(at, i, disc->target, samples);
          return sight.disc(disc->seen, samples, {key, i});
        };
        const shading::Visibility is = visibility(classifies, few);
        if (!is.is_certain) {
          ++here.partial;
          continue;
        }
        ++(math::is_black(is.mean) ? here.dark : here.lit);
        const shading::Visibility ought = visibility(casts, many);
        // The mean of equal numbers has roundings of its own.
        here.wrong += std::fabs(is.mean.g - ought.mean.g) > math::gamma(rays) ? 1 : 0;
      }
    }
    const std::lock_guard lock(mutex);
    counts.lit += here.lit, counts.dark += here.dark, counts.partial += here.partial, counts.wrong += here.wrong;
  });
  std::printf("%s\n", nlohmann::json{{"scene", job.scene.name},
                                     {"rays", rays},
                                     {"lit", counts.lit},
                                     {"dark", counts.dark},
                                     {"partial", counts.partial},
                                     {"wrong", counts.wrong}}
                          .dump()
                          .c_str());
  return counts.wrong == 0 ? 0 : 1;
}

}  // namespace
}  // namespace penumbra::bench

int main(int argc, char** argv) {
  int edge = 800, grid = 64, rays = 4096;
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    (name == "--edge" ? edge : name == "--grid" ? grid : rays) = std::stoi(argv[i + 1]);
  }
  if (argc < 2) return std::fprintf(stderr, "usage: bench_points SCENE.json [--edge N] [--grid N] [--rays N]\n"), 2;
  return penumbra::bench::bench(argv[1], edge, grid, rays);
}
