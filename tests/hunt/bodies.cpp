#include "tests/hunt/bodies.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/math/constants.h"

namespace penumbra::hunt {
namespace {

/// The middle one of the distances from the camera says how large a scene is.
void collect(const std::vector<scene::Object>& objects, const scene::Description& scene, const Affine& placement,
             std::vector<Vec3>& points) {
  for (const scene::Object& object : objects) {
    const auto take = [&](const Vec3& p) { points.push_back(placement.point(p)); };
    if (const auto* sphere = std::get_if<scene::Sphere>(&object.shape)) take(sphere->center);
    if (const auto* triangle = std::get_if<scene::Triangle>(&object.shape))
      std::ranges::for_each(triangle->vertices, take);
    if (const auto* polygon = std::get_if<scene::Polygon>(&object.shape))
      std::ranges::for_each(polygon->vertices, take);
    if (const auto* plane = std::get_if<scene::Plane>(&object.shape)) take(plane->point);
    if (const auto* tube = std::get_if<scene::Tube>(&object.shape)) take(tube->point);
    if (const auto* cylinder = std::get_if<scene::Cylinder>(&object.shape)) take(cylinder->point);
    if (const auto* mesh = std::get_if<scene::Mesh>(&object.shape)) std::ranges::for_each(mesh->positions, take);
    if (const auto* instance = std::get_if<scene::Instance>(&object.shape)) {
      for (const Vec3& p : scene.meshes[static_cast<std::size_t>(instance->mesh)].positions)
        take(instance->transform.point(p));
    }
    if (const auto* group = std::get_if<scene::Group>(&object.shape))
      collect(group->objects, scene, placement * group->transform, points);
  }
}

double cut(const Vec3& a, const Vec3& b, const Vec3& c) { return math::dot(a, math::cross(b, c)); }

/// Even-odd, after dropping the coordinate in which the plane is steepest.
bool is_inside(const std::vector<Vec3>& outline, const Vec3& normal, const Vec3& p) {
  const Vec3 weight = math::abs(normal);
  const int drop = weight.x >= weight.y && weight.x >= weight.z ? 0 : weight.y >= weight.z ? 1 : 2;
  const int x = (drop + 1) % 3, y = (drop + 2) % 3;
  bool inside = false;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec3 &a = outline[i], &b = outline[(i + 1) % outline.size()];
    if ((a[y] > p[y]) == (b[y] > p[y])) continue;
    if (p[x] < a[x] + (b[x] - a[x]) * (p[y] - a[y]) / (b[y] - a[y])) inside = !inside;
  }
  return inside;
}

/// t at which (x, y) or (x, y, z) of a line has length 1, from its point nearest to the axis or the center.
std::array<double, 2> unit_roots(Vec3 o, Vec3 d, bool is_round_in_z) {
  if (!is_round_in_z) o.z = d.z = 0;
  const double a = math::dot(d, d);
  if (a == 0) return {math::nan, math::nan};
  const double nearest = -math::dot(o, d) / a;
  const Vec3 l = o + d * nearest;
  const double length = std::sqrt(math::dot(l, l)), squared = (1 - length) * (1 + length);
  const double half = squared < 0 ? math::nan : std::sqrt(squared / a);
  return {nearest - half, nearest + half};
}

}  // namespace

Frame::Frame(const scene::Description& scene) : center(scene.camera.position) {
  std::vector<Vec3> points;
  collect(scene.objects, scene, {}, points);
  std::vector<double> distances;
  for (const Vec3& p : points) distances.push_back(math::length(p - center));
  if (distances.empty()) return;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  if (*middle > 0) scale = std::exp2(std::round(std::log2(8 / *middle)));
}

Vec3 Frame::point(const Vec3& p, const Affine& placement) const {
  const auto coordinate = [&](int axis) {
    long double sum = placement.translation[axis];
    for (int i = 0; i < 3; ++i) sum += static_cast<long double>(placement.column[i][axis]) * p[i];
    return static_cast<double>((sum - center[axis]) * scale);
  };
  return {coordinate(0), coordinate(1), coordinate(2)};
}

Bodies::Bodies(const scene::Description& scene, const Frame& frame) : frame_(frame) {
  for (const scene::Object& object : scene.objects) add(scene, object, {});
}

void Bodies::add(const scene::Description& scene, const scene::Object& object, const Affine& placement) {
  if (const auto* group = std::get_if<scene::Group>(&object.shape)) {
    for (const scene::Object& member : group->objects) add(scene, member, placement * group->transform);
    return;
  }
  bodies_.push_back({});
  bodies_.back().material = &scene.materials[static_cast<std::size_t>(object.material)];
  if (const auto* sphere = std::get_if<scene::Sphere>(&object.shape))
    add_round(Kind::sphere, sphere->center, {0, 0, 1}, sphere->radius, sphere->radius, placement);
  if (const auto* tube = std::get_if<scene::Tube>(&object.shape))
    add_round(Kind::tube, tube->point, tube->direction, tube->radius, tube->radius, placement);
  if (const auto* cylinder = std::get_if<scene::Cylinder>(&object.shape)) {
    add_round(Kind::cylinder, cylinder->point, cylinder->direction, cylinder->radius, cylinder->height, placement);
    bodies_.back().caps = cylinder->caps;
  }
  if (const auto* plane = std::get_if<scene::Plane>(&object.shape)) {
    Body& body = bodies_.back();
    body.kind = Kind::plane;
    body.point = frame_.point(plane->point, placement);
    body.normal = math::normalize(math::inverse(placement).transposed_vector(math::normalize(plane->normal)));
  }
  if (const auto* triangle = std::get_if<scene::Triangle>(&object.shape))
    add_mesh({{triangle->vertices.begin(), triangle->vertices.end()}, {{0, 1, 2}}, {}}, placement);
  if (const auto* polygon = std::get_if<scene::Polygon>(&object.shape)) add_polygon(polygon->vertices, placement);
  if (const auto* mesh = std::get_if<scene::Mesh>(&object.shape)) add_mesh(*mesh, placement);
  if (const auto* instance = std::get_if<scene::Instance>(&object.shape))
    add_mesh(scene.meshes[static_cast<std::size_t>(instance->mesh)], placement * instance->transform);
}

void Bodies::add_round(Kind kind, const Vec3& base, const Vec3& axis, double radius, double height,
                       const Affine& placement) {
  const Vec3 w = math::normalize(axis),
             u = math::normalize(math::cross(std::fabs(w.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}, w));
  const double r = radius * frame_.scale, h = height * frame_.scale;
  const Affine to_world{{placement.vector(u) * r, placement.vector(math::cross(w, u)) * r, placement.vector(w) * h},
                        frame_.point(base, placement)};
  Body& body = bodies_.back();
  body.kind = kind;
  body.to_local = math::inverse(to_world);
  if (kind == Kind::tube) return;
  body.middle = to_world.point(kind == Kind::sphere ? Vec3{} : Vec3{0, 0, 0.5});
  body.reach =
      1.001 * (math::length(to_world.column[0]) + math::length(to_world.column[1]) + math::length(to_world.column[2]));
}

void Bodies::enclose(const std::vector<Vec3>& points) {
  Body& body = bodies_.back();
  body.middle = {};
  for (const Vec3& p : points) body.middle += p * (1 / static_cast<double>(points.size()));
  body.reach = 0;
  for (const Vec3& p : points) body.reach = std::max(body.reach, 1.001 * math::length(p - body.middle));
}

void Bodies::add_mesh(const scene::Mesh& mesh, const Affine& placement) {
  Body& body = bodies_.back();
  body.kind = Kind::triangles;
  const Affine back = math::inverse(placement);
  std::vector<Vec3> world;
  for (const Vec3& p : mesh.positions) world.push_back(frame_.point(p, placement));
  for (const auto& [a, b, c] : mesh.triangles) {
    Face face{world[a], world[b] - world[a], world[c] - world[a], {}, {}};
    const Vec3 across = math::cross(face.edge_u, face.edge_v);
    if (!(math::length(across) > 0)) continue;
    face.normal = math::normalize(across) * (placement.determinant() < 0 ? -1.0 : 1.0);
    if (!mesh.normals.empty()) {
      const Vec3 local = math::cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
      int i = 0;
      for (const std::uint32_t corner : {a, b, c}) {
        const bool is_given = math::length(mesh.normals[corner]) > 0;
        face.smooth[i++] = back.transposed_vector(math::normalize(is_given ? mesh.normals[corner] : local));
      }
    }
    body.faces.push_back(face);
  }
  enclose(world);
}

void Bodies::add_polygon(const std::vector<Vec3>& vertices, const Affine& placement) {
  Body& body = bodies_.back();
  body.kind = Kind::polygon;
  for (const Vec3& p : vertices) body.outline.push_back(frame_.point(p, placement));
  Vec3 area;
  const std::vector<Vec3>& o = body.outline;
  for (std::size_t i = 1; i + 1 < o.size(); ++i) area += math::cross(o[i] - o[0], o[i + 1] - o[0]);
  body.point = o[0];
  body.normal = math::normalize(area) * (placement.determinant() < 0 ? -1.0 : 1.0);
  enclose(o);
}

void Bodies::meet(std::size_t index, const Vec3& origin, const Vec3& direction, std::vector<Crossing>& found) const {
  const Body& body = bodies_[index];
  const auto id = static_cast<std::uint32_t>(index);
  if (body.reach < math::infinity) {
    const Vec3 across = math::cross(body.middle - origin, direction);
    if (math::dot(across, across) > body.reach * body.reach * math::dot(direction, direction)) return;
  }
  if (body.kind == Kind::plane || body.kind == Kind::polygon) {
    const double slope = math::dot(direction, body.normal);
    if (slope == 0) return;
    const double t = math::dot(body.point - origin, body.normal) / slope;
    if (body.kind == Kind::plane || is_inside(body.outline, body.normal, origin + direction * t))
      found.push_back({t, id, 0, 0, 0});
    return;
  }
  if (body.kind == Kind::triangles) {
    for (std::uint32_t i = 0; i < body.faces.size(); ++i) {
      const Face& face = body.faces[i];
      const Vec3 from = origin - face.corner;
      const double whole = -cut(direction, face.edge_u, face.edge_v);
      if (whole == 0) continue;
      const double u = -cut(direction, from, face.edge_v) / whole, v = -cut(direction, face.edge_u, from) / whole;
      if (u < 0 || v < 0 || u + v > 1) continue;
      found.push_back({cut(from, face.edge_u, face.edge_v) / whole, id, i, u, v});
    }
    return;
  }
  const Vec3 o = body.to_local.point(origin), d = body.to_local.vector(direction);
  for (const double t : unit_roots(o, d, body.kind == Kind::sphere)) {
    const double z = o.z + t * d.z;
    if (!std::isnan(t) && (body.kind != Kind::cylinder || (z >= 0 && z <= 1))) found.push_back({t, id, 0, 0, 0});
  }
  if (!body.caps || d.z == 0) return;
  for (const std::uint32_t end : {0u, 1u}) {
    const double t = (end - o.z) / d.z, x = o.x + t * d.x, y = o.y + t * d.y;
    if (x * x + y * y <= 1) found.push_back({t, id, 1 + end, 0, 0});
  }
}

Normals Bodies::normals_at(const Crossing& crossing, const Vec3& origin, const Vec3& direction) const {
  const Body& body = bodies_[crossing.body];
  if (body.kind == Kind::plane || body.kind == Kind::polygon) return {body.normal, body.normal};
  if (body.kind == Kind::triangles) {
    const Face& face = body.faces[crossing.part];
    const Vec3 smooth =
        face.smooth[0] * (1 - crossing.u - crossing.v) + face.smooth[1] * crossing.u + face.smooth[2] * crossing.v;
    return {face.normal, math::length(smooth) > 0 ? math::normalize(smooth) : face.normal};
  }
  Vec3 local = body.to_local.point(origin + direction * crossing.t);
  if (body.kind != Kind::sphere) local.z = 0;
  if (crossing.part > 0) local = {0, 0, crossing.part == 1 ? -1.0 : 1.0};
  const Vec3 normal = math::normalize(body.to_local.transposed_vector(local));
  return {normal, normal};
}

}  // namespace penumbra::hunt
