#pragma once
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/math/affine.h"
#include "tests/hunt/random.h"

namespace penumbra::hunt {

using Json = nlohmann::ordered_json;
using math::Affine;
using math::Vec3;

/// Writes a scene at a scale of a few units around the origin, the floor at y = 0. Where things are neither coincident
/// nor touching they are apart by far more than rounding.
class Maker {
 public:
  explicit Maker(const Random& r) : random(r) {}

  Random random;
  Json scene = Json::object(), options = Json::object();

  static Json json(const Vec3& v) { return {v.x, v.y, v.z}; }
  double in(double low, double high) { return random.in(low, high); }
  bool chance(double p) { return random.chance(p); }
  int below(int n) { return random.below(n); }
  Vec3 point(double reach, double low, double high) { return {in(-reach, reach), in(low, high), in(-reach, reach)}; }
  Vec3 direction();

  void camera(const Vec3& position, const Vec3& look_at, double fov);
  /// Looks at the middle of things from somewhere above the floor.
  void camera_anywhere();
  void size(int width, int height) { options["width"] = width, options["height"] = height; }

  Json color(double low, double high);
  Json matt();
  Json shiny();
  Json mirror();
  Json pane();          // transmits straight on
  Json glass();         // refracts
  Json any_material();  // mostly opaque
  void object(Json object, const Json& material);
  void floor(const Json& material);  // a plane, or a polygon
  void tiles(const Vec3& corner, const Vec3& u, const Vec3& v, int across, int along, int kind, const Json& material);

  Json sphere(const Vec3& center, double radius) {
    return {{"type", "sphere"}, {"center", json(center)}, {"radius", radius}};
  }
  Json plane(const Vec3& point, const Vec3& normal) {
    return {{"type", "plane"}, {"point", json(point)}, {"normal", json(normal)}};
  }
  Json polygon(const std::vector<Vec3>& vertices);
  Json triangle(const Vec3& a, const Vec3& b, const Vec3& c);
  Json rectangle(const Vec3& corner, const Vec3& u, const Vec3& v) {
    return polygon({corner, corner + u, corner + u + v, corner + v});
  }
  Json star(const Vec3& center, const Vec3& normal, double radius, int points);
  Json cylinder(const Vec3& base, const Vec3& direction, double radius, double height, bool caps = true);
  Json tube(const Vec3& p, const Vec3& direction, double radius);
  Json box(const Vec3& low, const Vec3& high);
  /// A ball or a ring of triangles.
  Json ball_mesh(const Vec3& center, double radius, int steps, bool smooth);
  Json ring_mesh(const Vec3& center, double radius, double thickness, int steps, bool smooth);
  Json grid_mesh(int steps);
  Json placed(const std::string& mesh, const Affine& transform);
  static Json matrix(const Affine& transform);
  /// Rotated, and by chance stretched, sheared or mirrored.
  Affine skewed(const Vec3& at, double scale);

  void point_light(const Vec3& position, double radius, double intensity = 1);
  void spot_light(const Vec3& position, const Vec3& direction, double radius);
  void sun(const Vec3& direction, double angle);
  void panel(const Vec3& corner, const Vec3& u, const Vec3& v, double intensity);
  void lamp(const Vec3& center, double radius, double intensity);
  /// A soft light above, of any kind that has a disc.
  void soft_light();
  void any_light();
  /// Some opaque things standing on, and flying above, the floor.
  void clutter(int count);
};

struct Profile {
  const char* name;
  void (*make)(Maker&);
};

std::vector<Profile> flat_profiles();
std::vector<Profile> contact_profiles();
std::vector<Profile> glass_profiles();
std::vector<Profile> light_profiles();
std::vector<Profile> shape_profiles();
std::vector<Profile> camera_profiles();

/// All of them, in turn.
const std::vector<Profile>& profiles();

struct Made {
  std::string profile;
  Json job;
};

/// The same for the same numbers, anywhere.
Made make_scene(std::uint64_t seed, std::uint64_t index);
Made make_scene(std::uint64_t seed, std::uint64_t index, const Profile& profile);

/// The same scene elsewhere, in another unit, turned: `scale` times, rotated by `turn`'s columns, then moved.
void move_scene(Json& scene, const Affine& turn, double scale, const Vec3& to);

}  // namespace penumbra::hunt
