#include "tests/hunt/maker.h"

#include "tests/hunt/optics.h"

namespace penumbra::hunt {

Vec3 Maker::direction() {
  const double z = in(-1, 1), angle = in(0, 2 * pi), r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

void Maker::camera(const Vec3& position, const Vec3& look_at, double fov) {
  scene["camera"] = {{"position", json(position)}, {"look_at", json(look_at)}, {"vertical_fov", fov}};
}

void Maker::camera_anywhere() {
  const double angle = in(0, 2 * pi), far = in(5, 9);
  camera({far * std::sin(angle), in(0.8, 6), far * std::cos(angle)}, point(0.5, 0.3, 1), in(25, 55));
}

Json Maker::color(double low, double high) {
  if (chance(0.4)) return in(low, high);
  return {in(low, high), in(low, high), in(low, high)};
}

Json Maker::matt() { return {{"diffuse", color(0.2, 0.9)}}; }

Json Maker::shiny() {
  return {{"diffuse", color(0.1, 0.6)}, {"specular", color(0.1, 0.6)}, {"shininess", random.wide(1, 90)}};
}

Json Maker::mirror() { return {{"diffuse", color(0, 0.2)}, {"reflection", color(0.3, 0.93)}}; }

Json Maker::pane() {
  Json result{{"diffuse", color(0, 0.3)}, {"transmission", color(0.2, 0.95)}};
  if (chance(0.2)) result["reflection"] = color(0.03, 0.2);
  return result;
}

Json Maker::glass() {
  Json result{
      {"diffuse", 0.03}, {"transmission", color(0.4, 0.95)}, {"ior", chance(0.2) ? in(0.6, 0.95) : in(1.1, 1.9)}};
  if (chance(0.5)) result["reflection"] = color(0.03, 0.2);
  return result;
}

Json Maker::any_material() {
  const double which = random.uniform();
  return which < 0.5 ? matt() : which < 0.75 ? shiny() : which < 0.85 ? mirror() : which < 0.95 ? pane() : glass();
}

void Maker::object(Json object, const Json& material) {
  if (!material.is_null()) object["material"] = material;
  scene["objects"].push_back(std::move(object));
}

void Maker::floor(const Json& material) {
  if (chance(0.5)) return object(plane({in(-1, 1), 0, in(-1, 1)}, {0, in(0.5, 2), 0}), material);
  object(rectangle({-5, 0, 5}, {10, 0, 0}, {0, 0, -10}), material);
}

/// kind 0: rectangles, 1: triangles, 2: strips of unequal width
void Maker::tiles(const Vec3& corner, const Vec3& u, const Vec3& v, int across, int along, int kind,
                  const Json& material) {
  std::vector<double> a, b;
  for (int i = 0; i <= across; ++i) a.push_back((i + (kind == 2 && i > 0 && i < across ? in(-0.4, 0.4) : 0)) / across);
  for (int i = 0; i <= along; ++i) b.push_back((i + (kind == 2 && i > 0 && i < along ? in(-0.4, 0.4) : 0)) / along);
  const auto at = [&](int i, int k) {
    return corner + u * a[static_cast<std::size_t>(i)] + v * b[static_cast<std::size_t>(k)];
  };
  for (int i = 0; i < across; ++i) {
    for (int k = 0; k < along; ++k) {
      const Vec3 p = at(i, k), q = at(i + 1, k), r = at(i + 1, k + 1), s = at(i, k + 1);
      if (kind != 1) {
        object(polygon({p, q, r, s}), material);
      } else {
        object(triangle(p, q, r), material), object(triangle(p, r, s), material);
      }
    }
  }
}

Json Maker::polygon(const std::vector<Vec3>& vertices) {
  Json list = Json::array();
  for (const Vec3& v : vertices) list.push_back(json(v));
  return {{"type", "polygon"}, {"vertices", list}};
}

Json Maker::triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  return {{"type", "triangle"}, {"vertices", {json(a), json(b), json(c)}}};
}

Json Maker::star(const Vec3& center, const Vec3& normal, double radius, int points) {
  const Axes axes(math::normalize(normal));
  std::vector<Vec3> vertices;
  for (int i = 0; i < 2 * points; ++i) {
    const double angle = pi * i / points, r = radius * (i % 2 == 0 ? in(0.8, 1) : in(0.3, 0.5));
    vertices.push_back(center + axes.u * (r * std::cos(angle)) + axes.v * (r * std::sin(angle)));
  }
  return polygon(vertices);
}

Json Maker::cylinder(const Vec3& base, const Vec3& direction, double radius, double height, bool caps) {
  Json result{{"type", "cylinder"},
              {"point", json(base)},
              {"direction", json(direction)},
              {"radius", radius},
              {"height", height}};
  if (!caps) result["caps"] = false;
  return result;
}

Json Maker::tube(const Vec3& p, const Vec3& direction, double radius) {
  return {{"type", "tube"}, {"point", json(p)}, {"direction", json(direction)}, {"radius", radius}};
}

Json Maker::box(const Vec3& low, const Vec3& high) {
  Json positions = Json::array();
  for (int i = 0; i < 8; ++i) {
    for (int axis = 0; axis < 3; ++axis) positions.push_back((i >> axis & 1) == 0 ? low[axis] : high[axis]);
  }
  return {
      {"type", "mesh"}, {"positions", positions}, {"indices", {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                                               2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5}}};
}

Json Maker::ball_mesh(const Vec3& center, double radius, int steps, bool smooth) {
  Json positions = Json::array(), normals = Json::array(), indices = Json::array();
  const auto add = [&](const Vec3& n) {
    for (int axis = 0; axis < 3; ++axis)
      positions.push_back(center[axis] + radius * n[axis]), normals.push_back(n[axis]);
  };
  const int around = 2 * steps;
  add({0, -1, 0});
  for (int i = 1; i < steps; ++i) {
    const double y = -std::cos(pi * i / steps), r = std::sin(pi * i / steps);
    for (int k = 0; k < around; ++k) add({r * std::cos(2 * pi * k / around), y, -r * std::sin(2 * pi * k / around)});
  }
  add({0, 1, 0});
  const int last = (steps - 1) * around + 1;
  const auto at = [&](int i, int k) { return i == 0 ? 0 : i == steps ? last : 1 + (i - 1) * around + k % around; };
  for (int i = 0; i < steps; ++i) {
    for (int k = 0; k < around; ++k) {
      if (i > 0)
        for (const int index : {at(i, k), at(i, k + 1), at(i + 1, k)}) indices.push_back(index);
      if (i + 1 < steps)
        for (const int index : {at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)}) indices.push_back(index);
    }
  }
  Json result{{"type", "mesh"}, {"positions", positions}, {"indices", indices}};
  if (smooth) result["normals"] = normals;
  return result;
}

Json Maker::ring_mesh(const Vec3& center, double radius, double thickness, int steps, bool smooth) {
  Json positions = Json::array(), normals = Json::array(), indices = Json::array();
  const int around = steps / 2 + 3;
  for (int i = 0; i < steps; ++i) {
    const double a = 2 * pi * i / steps;
    for (int k = 0; k < around; ++k) {
      const double b = 2 * pi * k / around;
      const Vec3 n{std::cos(b) * std::cos(a), std::sin(b), std::cos(b) * std::sin(a)};
      const Vec3 p = center + Vec3{std::cos(a), 0, std::sin(a)} * radius + n * thickness;
      for (int axis = 0; axis < 3; ++axis) positions.push_back(p[axis]), normals.push_back(n[axis]);
    }
  }
  const auto at = [&](int i, int k) { return i % steps * around + k % around; };
  for (int i = 0; i < steps; ++i) {
    for (int k = 0; k < around; ++k) {
      for (const int index : {at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i, k), at(i + 1, k + 1), at(i + 1, k)})
        indices.push_back(index);
    }
  }
  Json result{{"type", "mesh"}, {"positions", positions}, {"indices", indices}};
  if (smooth) result["normals"] = normals;
  return result;
}

Json Maker::grid_mesh(int steps) {
  Json positions = Json::array(), indices = Json::array();
  for (int i = 0; i <= steps; ++i) {
    for (int k = 0; k <= steps; ++k) positions.push_back(k), positions.push_back(i), positions.push_back(0);
  }
  for (int i = 0; i < steps; ++i) {
    for (int k = 0; k < steps; ++k) {
      const int a = i * (steps + 1) + k, b = a + steps + 1;
      for (const int index : {a, a + 1, b + 1, a, b + 1, b}) indices.push_back(index);
    }
  }
  return {{"positions", positions}, {"indices", indices}};
}

Json Maker::matrix(const Affine& t) {
  Json result = Json::array();
  for (const Vec3& column : t.column) {
    for (int axis = 0; axis < 3; ++axis) result.push_back(column[axis]);
    result.push_back(0);
  }
  for (int axis = 0; axis < 3; ++axis) result.push_back(t.translation[axis]);
  result.push_back(1);
  return result;
}

Json Maker::placed(const std::string& mesh, const Affine& transform) {
  return {{"type", "instance"}, {"mesh", mesh}, {"transform", matrix(transform)}};
}

Affine Maker::skewed(const Vec3& at, double scale) {
  const Axes axes(direction());
  Affine result{{axes.u, axes.v, axes.w}, at};
  if (chance(0.6)) {
    for (Vec3& column : result.column) column = column * in(0.5, 1.6);
    if (chance(0.6)) result.column[0] += result.column[1] * in(-0.8, 0.8);
    if (chance(0.4)) result.column[2] += result.column[0] * in(-0.8, 0.8);
  }
  if (chance(0.4)) result.column[1] = -result.column[1];
  for (Vec3& column : result.column) column = column * scale;
  return result;
}

void Maker::point_light(const Vec3& position, double radius, double intensity) {
  Json light{{"type", "point"}, {"position", json(position)}, {"intensity", intensity}, {"radius", radius}};
  if (chance(0.3)) light["intensity"] = color(0.3, 1.5);
  if (chance(0.3)) light["attenuation"] = {in(0.3, 1), in(0, 0.2), in(0, 0.1)};
  scene["lights"].push_back(light);
}

void Maker::spot_light(const Vec3& position, const Vec3& direction, double radius) {
  Json light{{"type", "spot"},
             {"position", json(position)},
             {"direction", json(direction)},
             {"intensity", color(0.5, 1.5)},
             {"radius", radius}};
  if (chance(0.7)) light["exponent"] = chance(0.2) ? 0 : random.wide(0.2, 30);
  if (chance(0.7)) light["cutoff"] = in(15, 120);
  scene["lights"].push_back(light);
}

void Maker::sun(const Vec3& direction, double angle) {
  scene["lights"].push_back({{"type", "directional"},
                             {"direction", json(direction)},
                             {"intensity", color(0.3, 1)},
                             {"angular_radius", angle}});
}

void Maker::panel(const Vec3& corner, const Vec3& u, const Vec3& v, double intensity) {
  scene["lights"].push_back({{"type", "rectangle"},
                             {"corner", json(corner)},
                             {"edge_u", json(u)},
                             {"edge_v", json(v)},
                             {"intensity", intensity}});
}

void Maker::lamp(const Vec3& center, double radius, double intensity) {
  scene["lights"].push_back(
      {{"type", "sphere"}, {"center", json(center)}, {"radius", radius}, {"intensity", intensity}});
}

void Maker::soft_light() {
  const Vec3 at = point(3, 2.5, 6);
  const int which = below(4);
  if (which < 2) return point_light(at, in(0.1, 1.5));
  if (which == 2) return spot_light(at, point(1, 0, 0.5) - at, in(0.1, 1));
  sun(point(1, -2, -0.6), in(0.5, 12));
}

void Maker::any_light() {
  const Vec3 at = point(3, 2.5, 6);
  const int which = below(7);
  if (which < 3) return soft_light();
  if (which == 3) return point_light(at, 0);
  if (which == 4) return sun(point(1, -2, -0.6), 0);
  if (which == 5) return lamp(at, in(0.2, 1), in(3, 12));
  panel(at, {in(0.5, 2), 0, in(-0.5, 0.5)}, {in(-0.3, 0.3), 0, in(0.5, 2)}, in(2, 8));
}

void Maker::clutter(int count) {
  for (int i = 0; i < count; ++i) {
    const Vec3 p = point(2, 0, 0);
    const double size = in(0.2, 0.8), up = chance(0.5) ? 0 : in(0.2, 1.2);
    const Vec3 at = p + Vec3{0, up, 0};
    switch (below(7)) {
      case 0:
        object(sphere(at + Vec3{0, size, 0}, size), any_material());
        break;
      case 1:
        object(box(at, at + Vec3{size, in(0.3, 1.5), in(0.3, 1)}), any_material());
        break;
      case 2:
        object(cylinder(at, {0, 1, 0}, size / 2, in(0.3, 1.8), chance(0.7)), any_material());
        break;
      case 3:
        object(triangle(at, at + point(1, 0.1, 1), at + point(1, 0.4, 1.5)), any_material());
        break;
      case 4:
        object(star(at + Vec3{0, 0.7, 0}, direction(), size, 3 + below(4)), any_material());
        break;
      case 5:
        object(ball_mesh(at + Vec3{0, 0.7, 0}, size, 3 + below(5), chance(0.3)), matt());
        break;
      default:
        object(cylinder(at + Vec3{0, 0.5, 0}, direction(), size / 2, in(0.3, 1.5), chance(0.5)), any_material());
    }
  }
}

}  // namespace penumbra::hunt
