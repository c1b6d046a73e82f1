// Equal rays: Penumbra's single-ray calls beside Embree's, interleaved in one process, and the builds of both.
// Usage: bench_rays SCENE.json [--runs N] [--json FILE]
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/accel/queries.h"
#include "engine/math/constants.h"
#include "engine/render/camera.h"
#include "engine/render/canvas.h"
#include "tests/bench/embree_scene.h"
#include "tests/bench/sample_patterns.h"
#include "tests/bench/workload.h"

namespace penumbra::bench {
namespace {

constexpr int edge = 800;         // pixels
constexpr int light_samples = 4;  // shadow rays a hit

/// The same rays for both: doubles with the surface they leave for Penumbra; floats that start a little off it for
/// Embree.
struct RaySet {
  std::vector<accel::Ray> rays;
  std::vector<RTCRay> embree;
  double limit = 0;
};

RTCRay embree_ray(const Vec3& origin, const Vec3& direction, double limit) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x), ray.org_y = static_cast<float>(origin.y);
  ray.org_z = static_cast<float>(origin.z), ray.dir_x = static_cast<float>(direction.x);
  ray.dir_y = static_cast<float>(direction.y), ray.dir_z = static_cast<float>(direction.z);
  ray.tfar = static_cast<float>(limit), ray.mask = 0xffffffff;
  return ray;
}

RaySet primary_rays(const scene::Camera& description) {
  const render::Camera camera(description, edge, edge);
  const render::Canvas canvas(edge, edge);
  RaySet set;
  set.limit = math::infinity;
  for (int i = 0; i < canvas.tile_count(); ++i) {
    const render::Canvas::Tile tile = canvas.tile(i);
    for (int row = tile.top; row < tile.bottom; ++row) {
      for (int column = tile.left; column < tile.right; ++column) {
        set.rays.push_back(camera.ray(column + 0.5, row + 0.5, {}));
        set.embree.push_back(embree_ray(set.rays.back().origin, set.rays.back().direction, set.limit));
      }
    }
  }
  return set;
}

/// From every hit of `primary` that faces it, to points on the disc light.
RaySet shadow_rays(const accel::World& world, const RaySet& primary, const shading::DiscLight& light) {
  RaySet set;
  set.limit = 1;
  for (std::size_t i = 0; i < primary.rays.size(); ++i) {
    const accel::Ray& ray = primary.rays[i];
    const auto hit = accel::closest_hit(world, ray);
    if (!hit) continue;
    const geometry::SurfacePoint at = accel::surface_at(world, ray, *hit);
    const Vec3 facing = math::dot(at.normal, ray.direction) > 0 ? -at.normal : at.normal;
    const Vec3 axis = light.position - at.position;
    if (math::dot(facing, axis) <= light.radius) continue;
    const Vec3 off = at.position + facing * (1e-5 * math::length(axis));
    const math::Frame frame = math::frame_around(math::normalize(axis));
    Random random(i);
    for (int k = 0; k < light_samples; ++k) {
      const float across = random.uniform();
      const SamplePoint on_disc = concentric(across, random.uniform());
      const Vec3 towards =
          axis + (frame.u * static_cast<double>(on_disc.x) + frame.v * static_cast<double>(on_disc.y)) * light.radius;
      set.rays.push_back({geometry::leave_surface(at, towards), towards, hit->surface});
      set.embree.push_back(embree_ray(off, at.position + towards - off, set.limit));
    }
  }
  return set;
}

using Answers = std::vector<double>;  // t of the closest hit, or 1 for occluded; −1 for none

double closest_hits(const accel::World& world, const RaySet& set, int threads, Answers& answers) {
  return timed_in_pieces(set.rays.size(), threads, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const auto hit = accel::closest_hit(world, set.rays[i]);
      answers[i] = hit ? hit->t : -1;
    }
  });
}

double occlusions(const accel::World& world, const RaySet& set, int threads, Answers& answers) {
  return timed_in_pieces(set.rays.size(), threads, [&](std::size_t first, std::size_t last) {
    accel::Crossed crossed;
    for (std::size_t i = first; i < last; ++i) {
      answers[i] = accel::cross_transparent(world, set.rays[i], set.limit, crossed) ? -1 : 1;
    }
  });
}

double closest_hits(const EmbreeScene& embree, const RaySet& set, int threads, Answers& answers) {
  return timed_in_pieces(set.rays.size(), threads, [&](std::size_t first, std::size_t last) {
    const FlushedDenormals flushed;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (std::size_t i = first; i < last; ++i) {
      RTCRayHit query;
      query.ray = set.embree[i];
      query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(embree.scene(), &context, &query);
      answers[i] = query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? -1 : static_cast<double>(query.ray.tfar);
    }
  });
}

double occlusions(const EmbreeScene& embree, const RaySet& set, int threads, Answers& answers) {
  return timed_in_pieces(set.rays.size(), threads, [&](std::size_t first, std::size_t last) {
    const FlushedDenormals flushed;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (std::size_t i = first; i < last; ++i) {
      RTCRay ray = set.embree[i];
      rtcOccluded1(embree.scene(), &context, &ray);
      answers[i] = ray.tfar < 0 ? 1 : -1;
    }
  });
}

/// How many answers are not the same hit: one hits and the other does not, or they hit further apart than float noise.
std::size_t differing(const Answers& a, const Answers& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!(std::fabs(a[i] - b[i]) <= 1e-4 * std::fabs(a[i]))) ++count;
  }
  return count;
}

/// Penumbra's figure over a peer's, run by run.
std::vector<double> ratios(const std::vector<double>& over, const std::vector<double>& under) {
  std::vector<double> result;
  for (std::size_t i = 0; i < over.size(); ++i) result.push_back(over[i] / under[i]);
  return result;
}

struct Contest {
  const char* name;
  const RaySet& set;
  std::function<double(Answers&)> penumbra, embree, robust;
};

nlohmann::json run(const Contest& contest, int threads, int runs) {
  const std::size_t count = contest.set.rays.size();
  Answers penumbra(count), embree(count), robust(count);
  std::map<std::string, std::vector<double>> rates;
  for (int i = -1; i < runs; ++i) {  // the first round only warms up
    const double p = contest.penumbra(penumbra), e = contest.embree(embree), r = contest.robust(robust);
    if (i < 0) continue;
    rates["penumbra"].push_back(static_cast<double>(count) / p / 1e6);
    rates["embree"].push_back(static_cast<double>(count) / e / 1e6);
    rates["embree robust"].push_back(static_cast<double>(count) / r / 1e6);
  }
  const auto over_default = ratios(rates["penumbra"], rates["embree"]);
  const auto over_robust = ratios(rates["penumbra"], rates["embree robust"]);
  std::printf("  %-8s %d  %7.2f %7.2f %7.2f   %s   %s   %zu / %zu of %zu\n", contest.name, threads,
              median(rates["penumbra"]), median(rates["embree"]), median(rates["embree robust"]),
              spread(over_default).c_str(), spread(over_robust).c_str(), differing(penumbra, embree),
              differing(penumbra, robust), count);
  return {{"rays", contest.name},
          {"threads", threads},
          {"count", count},
          {"mrays", rates},
          {"differing_default", differing(penumbra, embree)},
          {"differing_robust", differing(penumbra, robust)}};
}

nlohmann::json builds(const scene::Description& description, const FlatScene& flat, int threads, int runs) {
  std::vector<double> penumbra, embree;
  const std::vector<scene::Material> all_opaque;
  system::Pool pool(threads);
  for (int i = 0; i < runs; ++i) {
    penumbra.push_back(1e3 * timed([&] { compile_with(description, pool); }));
    embree.push_back(1e3 * EmbreeScene(flat, all_opaque, {threads, false}).build_seconds());
  }
  std::printf("  build    %d  %7.2f %7.2f ms        %s\n", threads, median(penumbra), median(embree),
              spread(ratios(penumbra, embree)).c_str());
  return {{"threads", threads}, {"penumbra_ms", penumbra}, {"embree_ms", embree}};
}

int bench(const std::string& path, int runs, const std::string& json_path) {
  const api::JobRequest job = load_job(path);
  const FlatScene flat = flatten(job.scene);
  system::Pool pool(2);
  const render::Compiled compiled = compile_with(job.scene, pool);
  const accel::World& world = compiled.scene.world;
  const std::vector<scene::Material> all_opaque;
  const EmbreeScene embree(flat, all_opaque, {2, false}), robust(flat, all_opaque, {2, true});
  const RaySet primary = primary_rays(job.scene.camera);
  const RaySet shadow = shadow_rays(world, primary, std::get<shading::DiscLight>(compiled.scene.lights.front()));

  std::printf("%s, %zu triangles, %zu spheres, %zu cylinders, median of %d\n", job.scene.name.c_str(),
              flat.triangles.size(), flat.spheres.size(), flat.cylinders.size(), runs);
  std::printf("  Mrays/s  threads, Penumbra, Embree, Embree robust; Penumbra / Embree, / robust; hits that differ\n");
  nlohmann::json report{
      {"scene", job.scene.name}, {"rays", nlohmann::json::array()}, {"builds", nlohmann::json::array()}};
  for (const int threads : {1, 2}) {
    const auto contest = [&](const char* name, const RaySet& set, auto query) {
      return run({name, set, [&, query](Answers& a) { return query(world, set, threads, a); },
                  [&, query](Answers& a) { return query(embree, set, threads, a); },
                  [&, query](Answers& a) { return query(robust, set, threads, a); }},
                 threads, runs);
    };
    report["rays"].push_back(contest("primary", primary, [](const auto& scene, const RaySet& set, int n, Answers& a) {
      return closest_hits(scene, set, n, a);
    }));
    report["rays"].push_back(contest("shadow", shadow, [](const auto& scene, const RaySet& set, int n, Answers& a) {
      return occlusions(scene, set, n, a);
    }));
    report["builds"].push_back(builds(job.scene, flat, threads, runs));
  }
  if (!json_path.empty()) std::ofstream(json_path) << report.dump(1) << '\n';
  return 0;
}

}  // namespace
}  // namespace penumbra::bench

int main(int argc, char** argv) {
  std::map<std::string, std::string> option{{"--runs", "7"}, {"--json", ""}};
  for (int i = 2; i + 1 < argc; i += 2) option[argv[i]] = argv[i + 1];
  if (argc < 2) return std::fprintf(stderr, "usage: bench_rays SCENE.json [--runs N] [--json FILE]\n"), 2;
  return penumbra::bench::bench(argv[1], std::atoi(option["--runs"].c_str()), option["--json"]);
}
