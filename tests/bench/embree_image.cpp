#include "tests/bench/embree_image.h"

#include <cmath>

#include "tests/bench/area_rays.h"
#include "tests/bench/contract_image.h"
#include "tests/bench/embree_shadows.h"
#include "tests/bench/sample_patterns.h"
#include "tests/bench/workload.h"

namespace penumbra::bench {
namespace {

PointPatterns jittered_grids(int samples, std::uint64_t seed, bool is_disc) {
  const int edge = static_cast<int>(std::lround(std::sqrt(samples)));
  Random random(seed);
  return {samples, [&](std::uint32_t, int i) {
            const float u = (static_cast<float>(i % edge) + random.uniform()) / static_cast<float>(edge);
            const float v = (static_cast<float>(i / edge) + random.uniform()) / static_cast<float>(edge);
            return is_disc ? concentric(u, v) : SamplePoint{u, v};
          }};
}

class EmbreeQueries {
 public:
  EmbreeQueries(const EmbreeScene& embree, const FlatScene& flat, const PointPatterns& grids,
                const PointPatterns& squares, const BruteForceSettings& settings)
      : embree_(embree), flat_(flat), grids_(grids), area_rays_(grids, squares), settings_(settings) {}

  std::optional<SurfaceHit> closest(const Vec3& origin, const Vec3& direction) const {
    return closest_with_embree(embree_, flat_, origin, direction);
  }
  Vec3 leave(const SurfaceHit& hit, const Vec3& direction) const { return off_surface(hit, direction); }

  Color visibility(const SurfaceHit& hit, const Vec3& facing, const Vec3& axis, const Vec3& u, const Vec3& v, double,
                   std::uint64_t place) const {
    const Vec3 origin = off_surface(hit, facing);
    const Vec3 towards = axis - (origin - hit.position);
    if (u == Vec3{}) {
      const float middle = 0;
      return cast_shadow_rays(embree_, {origin, towards, u, v}, &middle, &middle, 1, 1).sum;
    }
    Random random(place ^ (settings_.seed << 48));
    const std::uint32_t grid = random.bits() % PointPatterns::count;
    const DiscTarget target = DiscTarget{origin, towards, u, v}.turned(random.uniform());
    const ShadowSum result =
        cast_shadow_rays(embree_, target, grids_.x(grid), grids_.y(grid), grids_.samples(), settings_.packet_width);
    return result.sum * (1.0 / grids_.samples());
  }

  Color irradiance(const SurfaceHit& hit, const Vec3& facing, const AreaLight& light, std::uint64_t place) {
    const Vec3 origin = off_surface(hit, facing);
    Random random(place ^ (settings_.seed << 48));
    const std::uint32_t grid = random.bits() % PointPatterns::count;
    if (!area_rays_.aim(light, {origin, facing, hit.shading_normal}, grid, random)) return math::black;
    const int count = grids_.samples();
    const ShadowSum result = cast_shadow_rays(embree_, origin, area_rays_.lanes(), 0, count, settings_.packet_width);
    return result.sum * (area_rays_.solid_angle() / count);
  }

 private:
  const EmbreeScene& embree_;
  const FlatScene& flat_;
  const PointPatterns& grids_;
  AreaRays area_rays_;
  const BruteForceSettings& settings_;
};

}  // namespace

render::Film brute_force(const scene::Description& description, const FlatScene& flat, const EmbreeScene& embree,
                         const BruteForceSettings& settings) {
  const ContractLights lights = lights_of(description);
  const PointPatterns grids = jittered_grids(settings.shadow_samples, settings.seed, true);
  const PointPatterns squares =
      jittered_grids(lights.areas.empty() ? 0 : settings.shadow_samples, settings.seed, false);
  const PinholeCamera camera(description.camera, settings.width, settings.height);
  render::Film film(settings.width, settings.height);
  const std::size_t pixels = static_cast<std::size_t>(settings.width) * static_cast<std::size_t>(settings.height);
  timed_in_pieces(pixels, settings.threads, [&](std::size_t first, std::size_t last) {
    const FlushedDenormals flushed;
    EmbreeQueries queries(embree, flat, grids, squares, settings);
    ContractImage image(description, lights, queries);
    for (std::size_t i = first; i < last; ++i) {
      const int column = static_cast<int>(i) % settings.width, row = static_cast<int>(i) / settings.width;
      const Color color = image.radiance(camera.position(), camera.direction(column, row), i);
      film.rgb[3 * i] = static_cast<float>(color.r);
      film.rgb[3 * i + 1] = static_cast<float>(color.g);
      film.rgb[3 * i + 2] = static_cast<float>(color.b);
    }
  });
  return film;
}

}  // namespace penumbra::bench
