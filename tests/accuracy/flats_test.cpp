// A flat is a flat, however it is cut into triangles: under lamps wider than they are high, of which a part lies below
// it, its shadow on itself is what the contract says of a plane's.
#include <doctest/doctest.h>

#include "engine/render/camera.h"
#include "tests/robustness/worlds.h"
#include "tests/support/picture.h"

using namespace penumbra;
using test::Vec3;

namespace {

/// The flat's own coordinates: two along it, one up from it.
struct Frame {
  math::Frame axes;
  Vec3 origin;
  double scale;
  Vec3 operator()(double x, double y, double up = 0) const {
    return origin + (axes.u * x + axes.v * y + axes.n * up) * scale;
  }
};

/// A convex outline around 0, cut from its first vertex.
std::vector<scene::Object> outline(const Frame& at, test::Random& random) {
  scene::Polygon polygon;
  const int corners = 4 + random.below(5);
  for (int i = 0; i < corners; ++i) {
    const double turn = 6.283185307179586 * (i + random.between(0, 0.5)) / corners;
    polygon.vertices.push_back(at(9 * std::cos(turn), 9 * std::sin(turn)));
  }
  return {{polygon, {}}};
}

/// Squares of two triangles each, as one mesh or as triangles of their own.
std::vector<scene::Object> tiles(const Frame& at, int count, bool is_mesh) {
  const auto corner = [&](int column, int row) {
    const double step = 16.0 / count;
    return at(-8 + column * step, -8 + row * step);
  };
  scene::Mesh mesh;
  std::vector<scene::Object> objects;
  for (int row = 0; row <= count; ++row) {
    for (int column = 0; column <= count; ++column) mesh.positions.push_back(corner(column, row));
  }
  for (int row = 0; row < count; ++row) {
    for (int column = 0; column < count; ++column) {
      const auto a = static_cast<std::uint32_t>(row * (count + 1) + column),
                 above = a + static_cast<std::uint32_t>(count) + 1;
      for (const std::array<std::uint32_t, 3>& t : {std::array{a, a + 1, above + 1}, {a, above + 1, above}}) {
        mesh.triangles.push_back(t);
        if (!is_mesh)
          objects.push_back({scene::Triangle{{mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]}}, {}});
      }
    }
  }
  if (is_mesh) objects.push_back({mesh, {}});
  return objects;
}

/// The same flat as a mesh in a space of its own, stretched and sheared into place.
void add_as_instance(const Frame& at, scene::Description& scene) {
  scene::Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}, {0, 2, 0}, {1, 2, 0}, {2, 2, 0}};
  mesh.triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {3, 4, 7}, {3, 7, 6}, {4, 5, 8}, {4, 8, 7}};
  scene.meshes.push_back(mesh);
  const Vec3 from = at(-8, -8), along = (at(8, -8) - from) * 0.5, across = (at(-8, 8) - from) * 0.5;
  scene.objects.push_back({scene::Instance{scene::MeshId{0}, {{along, across, at(2, 1, 5) - from}, from}}, {}});
}

api::JobRequest under_a_lamp(const Frame& at, test::Random& random) {
  api::JobRequest job;
  job.scene = test::with_objects({});
  const Vec3 eye = at(random.between(-3, 3), random.between(-3, 3), 6), towards = at(0.1, 0.2, 0) - eye;
  job.scene.camera.position = eye, job.scene.camera.direction = math::normalize(towards);
  job.scene.camera.up = at.axes.u;
  job.scene.camera.vertical_fov_degrees = 50;
  const double height = random.between(0.05, 1), radius = height * random.between(1, 6);
  job.scene.lights = {
      scene::PointLight{at(random.between(-3, 3), random.between(-3, 3), height), math::white, {}, radius * at.scale}};
  job.options.width = 24, job.options.height = 18;
  return job;
}

/// The largest difference between the pictures of two flats, of which `cut` ends somewhere.
double worst(const api::JobRequest& cut, const api::JobRequest& whole) {
  // Beside the end of one flat there are fewer points to tell more of each other.
  render::Switches alone;
  alone.shared_samples = false;
  const render::Picture a = test::render(cut, alone), b = test::render(whole, alone);
  const shading::Scene scene = test::compiled(cut.scene);
  const render::Camera camera(cut.scene.camera, cut.options.width, cut.options.height);
  double largest = 0;
  for (int row = 0; row < cut.options.height; ++row) {
    for (int column = 0; column < cut.options.width; ++column) {
      if (!closest_hit(scene.world, camera.ray(column + 0.5, row + 0.5, {0, 0}))) continue;
      const std::size_t at = a.film->offset(column, row);
      largest = std::max<double>(largest, std::fabs(a.film->rgb[at] - b.film->rgb[at]));
    }
  }
  return largest;
}

}  // namespace

TEST_CASE("a flat cut into triangles is the plane under every lamp above it") {
  test::Random random(14);
  double largest = 0;
  for (int i = 0; i < test::count(150, 3000); ++i) {
    const double scale = std::ldexp(1.0, random.below(21) - 10);
    const bool is_level = random.below(2) == 0;
    const Frame at{math::frame_around(is_level ? Vec3{0, 1, 0} : random.direction()), random.in_cube(100 * scale),
                   scale};
    api::JobRequest job = under_a_lamp(at, random);
    api::JobRequest plane = job;
    plane.scene.objects = {{scene::Plane{at(0, 0), at.axes.n}, {}}};
    switch (i % 4) {
      case 0:
        job.scene.objects = outline(at, random);
        break;
      case 1:
        job.scene.objects = tiles(at, 1 + random.below(5), true);
        break;
      case 2:
        job.scene.objects = tiles(at, 1 + random.below(4), false);
        break;
      default:
        add_as_instance(at, job.scene);
        break;
    }
    job.options.acceleration = plane.options.acceleration = test::accelerations[i % 5];
    const double difference = worst(job, plane);
    largest = std::max(largest, difference);
    CHECK_MESSAGE(difference < 1e-5, "flat ", i);
  }
  MESSAGE("largest difference ", largest);
}
