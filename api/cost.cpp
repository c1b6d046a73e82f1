#include "api/cost.h"

#include <algorithm>
#include <cmath>
#include <variant>
#include <vector>

#include "api/job_request.h"

namespace penumbra::api {

namespace {

SceneSize operator+(const SceneSize& a, const SceneSize& b) {
  return {a.primitives + b.primitives, a.triangles + b.triangles, a.positions + b.positions,
          a.smooth_triangles + b.smooth_triangles, a.polygon_vertices + b.polygon_vertices};
}

SceneSize size_of_mesh(const scene::Mesh& mesh) {
  const std::size_t triangles = mesh.triangles.size();
  return {0, triangles, mesh.positions.size(), mesh.normals.empty() ? 0 : triangles, 0};
}

// As deep as the groups, which the reader of bodies bounds.
// NOLINTNEXTLINE(misc-no-recursion)
SceneSize size_of_objects(const std::vector<scene::Object>& objects) {
  SceneSize size;
  for (const scene::Object& object : objects) {
    ++size.primitives;
    if (const auto* group = std::get_if<scene::Group>(&object.shape)) size = size + size_of_objects(group->objects);
    if (const auto* mesh = std::get_if<scene::Mesh>(&object.shape)) size = size + size_of_mesh(*mesh);
    if (const auto* polygon = std::get_if<scene::Polygon>(&object.shape)) {
      size.polygon_vertices += polygon->vertices.size();
    }
  }
  return size;
}

/// Whether it takes as many samples as it is given.
bool is_sampled(const scene::Light& light) {
  return std::visit([](const auto& l) { return form_of(l) != scene::Form::point; }, light);
}

/// How many rays a camera ray becomes, itself included, where every surface reflects and transmits that much.
double rays_with(double reflection, double transmission, const scene::Options& options) {
  // Of the rays of a depth, how many were reflected i times: Pascal's triangle where they contribute enough.
  std::vector<double> rays{1};
  double sum = 1;
  for (int depth = 1; depth <= options.max_depth; ++depth) {
    rays.push_back(0);
    const double before = sum;
    for (int i = depth; i >= 0; --i) {
      const double contribution = std::pow(reflection, i) * std::pow(transmission, depth - i);
      double& count = rays[static_cast<std::size_t>(i)];
      if (i > 0) count += rays[static_cast<std::size_t>(i) - 1];
      if (!(contribution > 0 && contribution >= options.min_contribution)) count = 0;
      sum += count;
    }
    if (sum == before) break;
  }
  return sum;
}

/// What a camera ray can become: one ray after the other. Where materials do both it is a tree, of which most scenes
/// grow little, for rays soon meet nothing, or something else; it counts when it is so large that a scene might never
/// end.
double rays_of_a_path(const JobRequest& request) {
  double either = 0, reflection = 0, transmission = 0;
  for (const scene::Material& material : request.scene.materials) {
    const double r = max_channel(material.reflection), t = max_channel(material.transmission);
    either = std::max({either, r, t});
    if (r > 0 && t > 0) reflection = std::max(reflection, r), transmission = std::max(transmission, t);
  }
  constexpr double rampant = 1e5;
  const double tree = rays_with(reflection, transmission, request.options);
  return tree > rampant ? tree : rays_with(either, 0, request.options);
}

/// With so many camera rays in each of so many places, and so many samples of each soft light.
double work_of(const JobRequest& request, double places, int camera_rays, int shadow_samples) {
  double light_samples = 0;
  for (const scene::Light& light : request.scene.lights) light_samples += is_sampled(light) ? shadow_samples : 1;
  return places * camera_rays * (1 + light_samples) * rays_of_a_path(request);
}

/// What the options bound work by: the numbers of samples; for a target, which may need them or not, those before the
/// first look whether it is reached; and a budget of time.
double bounded_work(const JobRequest& request, std::int64_t pixels) {
  // Of each pixel eight, and some around a tile; of each light eight.
  constexpr int first_camera_rays = 8, first_shadow_samples = 8;
  const scene::Options& options = request.options;
  const int most = options.target_error ? first_camera_rays : options.samples_per_pixel;
  const int most_shadow = options.target_error ? first_shadow_samples : options.shadow_samples;
  const double work = work_of(request, static_cast<double>(pixels), std::min(most, options.samples_per_pixel),
                              std::min(most_shadow, options.shadow_samples));
  if (!options.time_budget_s) return work;
  // The first pass ends however long it takes: two rays for each tile.
  constexpr int tile_edge = 32, rays_of_a_tile = 2;
  const auto tiles = [](int pixels_of_edge) { return std::ceil(static_cast<double>(pixels_of_edge) / tile_edge); };
  const double first = work_of(request, tiles(options.width) * tiles(options.height), rays_of_a_tile, 1);
  return std::min(work, std::max(first, *options.time_budget_s * work_of_a_second));
}

std::size_t memory_of(const SceneSize& size, const JobRequest& request, std::int64_t pixels) {
  // Bytes, in doubles: what was read (kept while the scene is compiled), the compiled scene with its tree and, at the
  // same time, what the tree is built from.
  constexpr std::size_t read_triangle = 12, read_position = 24;
  constexpr std::size_t compiled_triangle = 72, smooth_triangle = 72 + 24, leaf_triangle = 80, tree_nodes = 72;
  constexpr std::size_t build_reference = 112;
  constexpr std::size_t triangle = read_triangle + compiled_triangle + leaf_triangle + tree_nodes + build_reference;
  constexpr std::size_t primitive = 768, polygon_vertex = read_position + triangle, material = 400, light = 400;
  // The film, the means and errors that refinement keeps, and the bytes of the image; within a time budget also the
  // film of the pass before.
  const std::size_t pixel = request.options.time_budget_s ? 52 : 36;
  return size.triangles * triangle + size.positions * read_position + size.smooth_triangles * smooth_triangle +
         size.primitives * primitive + size.polygon_vertices * polygon_vertex +
         request.scene.materials.size() * material + request.scene.lights.size() * light +
         static_cast<std::size_t>(pixels) * pixel;
}

}  // namespace

SceneSize size_of(const scene::Description& description) {
  SceneSize size = size_of_objects(description.objects);
  for (const scene::Mesh& mesh : description.meshes) size = size + size_of_mesh(mesh);
  return size;
}

CostEstimate estimate_cost(const JobRequest& request) {
  const SceneSize size = size_of(request.scene);
  CostEstimate cost;
  cost.primitives = size.primitives;
  cost.triangles = size.triangles;
  cost.lights = request.scene.lights.size();
  cost.pixels = std::int64_t{request.options.width} * request.options.height;
  cost.work = bounded_work(request, cost.pixels);
  cost.memory_bytes = memory_of(size, request, cost.pixels);
  return cost;
}

}  // namespace penumbra::api
