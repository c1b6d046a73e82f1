#include <algorithm>

#include "tests/hunt/maker.h"
#include "tests/hunt/optics.h"

namespace penumbra::hunt {
namespace {

Vec3 vector(const Json& j) { return {j[0], j[1], j[2]}; }

struct Move {
  Affine turn;
  double scale;
  Vec3 to;

  void point(Json& j) const { j = Maker::json(turn.vector(vector(j)) * scale + to); }
  void way(Json& j) const { j = Maker::json(turn.vector(vector(j))); }
  void length(Json& j) const { j = j.get<double>() * scale; }
  void at(Json& owner, const char* name, void (Move::*how)(Json&) const) const {
    if (owner.contains(name)) (this->*how)(owner[name]);
  }
  void flat(Json& list, bool is_point) const {
    for (std::size_t i = 0; i + 2 < list.size(); i += 3) {
      Json v{list[i], list[i + 1], list[i + 2]};
      is_point ? point(v) : way(v);
      for (std::size_t k = 0; k < 3; ++k) list[i + k] = v[k];
    }
  }
  void matrix(Json& m) const {
    Affine t;
    for (std::size_t c = 0; c < 3; ++c) t.column[c] = {m[4 * c], m[4 * c + 1], m[4 * c + 2]};
    t.translation = {m[12], m[13], m[14]};
    for (Vec3& column : t.column) column = turn.vector(column) * scale;
    t.translation = turn.vector(t.translation) * scale + to;
    m = Maker::matrix(t);
  }
  void object(Json& o) const {
    if (o.contains("transform")) return matrix(o["transform"]);
    if (o["type"] == "group") {
      for (Json& member : o["objects"]) object(member);
      return;
    }
    for (const char* name : {"center", "point"}) at(o, name, &Move::point);
    for (const char* name : {"normal", "direction"}) at(o, name, &Move::way);
    for (const char* name : {"radius", "height"}) at(o, name, &Move::length);
    if (o.contains("vertices"))
      for (Json& v : o["vertices"]) point(v);
    if (o.contains("positions")) flat(o["positions"], true);
    if (o.contains("normals")) flat(o["normals"], false);
  }
  void light(Json& l) const {
    for (const char* name : {"center", "position", "corner"}) at(l, name, &Move::point);
    at(l, "direction", &Move::way);
    at(l, "radius", &Move::length);
    for (const char* name : {"edge_u", "edge_v"}) {
      if (l.contains(name)) l[name] = Maker::json(turn.vector(vector(l[name])) * scale);
    }
    if (!l.contains("attenuation")) return;
    l["attenuation"][1] = l["attenuation"][1].get<double>() / scale;
    l["attenuation"][2] = l["attenuation"][2].get<double>() / (scale * scale);
  }
};

void choose_options(Maker& maker) {
  Random& random = maker.random;
  Json& options = maker.options;
  if (!options.contains("width")) maker.size(16 + random.below(9), 12 + random.below(7));
  if (!options.contains("shadow_samples")) {
    constexpr int counts[] = {4, 16, 16, 64, 64, 256};
    options["shadow_samples"] = counts[random.below(6)];
  }
  if (!options.contains("max_depth")) options["max_depth"] = 2 + random.below(5);
  constexpr const char* accelerations[] = {"none", "cbr", "groups", "median"};
  if (random.chance(0.3)) options["acceleration"] = accelerations[random.below(4)];
  options["seed"] = random.below(1'000'000);
  if (random.chance(0.5)) options["transfer"] = "linear";
}

}  // namespace

void move_scene(Json& scene, const Affine& turn, double scale, const Vec3& to) {
  const Move move{turn, scale, to};
  Json& camera = scene["camera"];
  if (!camera.contains("up")) camera["up"] = {0, 1, 0};
  for (const char* name : {"position", "look_at"}) move.at(camera, name, &Move::point);
  for (const char* name : {"direction", "up"}) move.at(camera, name, &Move::way);
  if (camera.contains("view_plane"))
    for (Json& length : camera["view_plane"]) move.length(length);
  if (camera.contains("lens"))
    for (Json& length : camera["lens"]) move.length(length);
  if (scene.contains("objects"))
    for (Json& object : scene["objects"]) move.object(object);
  if (scene.contains("lights"))
    for (Json& light : scene["lights"]) move.light(light);
}

const std::vector<Profile>& profiles() {
  static const std::vector<Profile> all = [] {
    std::vector<Profile> result;
    for (const auto& some :
         {flat_profiles(), contact_profiles(), glass_profiles(), light_profiles(), shape_profiles(), camera_profiles()})
      result.insert(result.end(), some.begin(), some.end());
    return result;
  }();
  return all;
}

Made make_scene(std::uint64_t seed, std::uint64_t index) {
  return make_scene(seed, index, profiles()[index % profiles().size()]);
}

Made make_scene(std::uint64_t seed, std::uint64_t index, const Profile& profile) {
  Maker maker(Random(seed, index));
  Random& random = maker.random;
  maker.scene["ambient"] = random.chance(0.5) ? 0 : 0.05;
  maker.scene["background"] = {0.2, 0.3, 0.5};
  profile.make(maker);
  if (!maker.scene.contains("camera")) maker.camera_anywhere();
  choose_options(maker);
  Affine turn;
  if (random.chance(0.25)) {
    const Axes axes(maker.direction());
    turn = {{axes.u, axes.v, axes.w}, {}};
  }
  double scale = 1;
  Vec3 to;
  if (random.chance(0.25)) scale = random.wide(1e-6, 1e6);
  if (random.chance(0.2)) to = maker.direction() * (scale * random.wide(1, 1e6) * 8);
  move_scene(maker.scene, turn, scale, to);
  return {profile.name, {{"scene", maker.scene}, {"options", maker.options}}};
}

}  // namespace penumbra::hunt
