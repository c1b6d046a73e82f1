#pragma once
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "api/job_request.h"

namespace penumbra::test {

inline std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The example scene clients/scenes/NAME.json.
inline api::JobRequest example(const std::string& name) {
  return api::parse_job(read_file(std::string(PENUMBRA_SOURCE_DIR) + "/clients/scenes/" + name + ".json"));
}

/// The scene NAME as the ray tracer that Penumbra replaces had it: one ray a pixel, written as linear.
inline api::JobRequest predecessor(const std::string& name) {
  return api::parse_job(read_file(std::string(PENUMBRA_SOURCE_DIR) + "/tests/support/predecessor/" + name + ".json"));
}

/// Every kind of shape, light and material in one small picture, without infinite shapes unless asked for.
inline api::JobRequest zoo() {
  return api::parse_job(R"({"scene": {
    "camera": {"position": [0, 4, 12], "look_at": [0, 1, 0], "vertical_fov": 40},
    "ambient": 0.1, "background": [0.2, 0.3, 0.5],
    "materials": {
      "red": {"diffuse": [0.8, 0.2, 0.1], "specular": 0.4, "shininess": 60},
      "glass": {"diffuse": 0.05, "specular": 0.5, "shininess": 200, "reflection": 0.1, "transmission": [0.9, 0.95, 0.9], "ior": 1.5},
      "pane": {"diffuse": 0.05, "transmission": [0.9, 0.5, 0.3]},
      "mirror": {"diffuse": 0.05, "reflection": 0.9, "specular": 0.5, "shininess": 100}},
    "meshes": {"tetrahedron": {"positions": [0,0,0, 1,0,0, 0,1,0, 0,0,1], "indices": [0,2,1, 0,1,3, 0,3,2, 1,2,3]}},
    "objects": [
      {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": {"diffuse": 0.6}},
      {"type": "sphere", "center": [-3, 1, 0], "radius": 1, "material": "red"},
      {"type": "sphere", "center": [-1, 0.7, 2.5], "radius": 0.7, "material": "glass"},
      {"type": "cylinder", "point": [1.2, 0, 1], "direction": [0, 1, 0], "radius": 0.6, "height": 1.6, "material": "red"},
      {"type": "cylinder", "point": [3, 0, 2], "direction": [0.3, 1, 0.2], "radius": 0.6, "height": 1.2, "caps": false, "material": "red"},
      {"type": "tube", "point": [0, 0.3, -3], "direction": [1, 0, 0.1], "radius": 0.3, "material": "mirror"},
      {"type": "polygon", "vertices": [[-5,0,-4], [-2,0,-4], [-2,3,-4], [-3.5,1.2,-4], [-5,3,-4]], "material": "red"},
      {"type": "polygon", "vertices": [[0.5,0,3], [2,0,3], [2,2,3], [0.5,2,3]], "material": "pane"},
      {"type": "triangle", "vertices": [[-2,0,3.5], [-1,0,4], [-1.5,1,3.6]], "material": "mirror"},
      {"type": "group", "transform": [1,0,0,0, 0,0.5,0,0, 0.5,0,1,0, 0,0,-1,1], "objects": [
        {"type": "sphere", "center": [0.5, 1, 0.5], "radius": 1, "material": "mirror"},
        {"type": "group", "objects": [{"type": "cylinder", "point": [2.5, 0, -1], "direction": [0, 1, 0], "radius": 0.5, "height": 4}]}]},
      {"type": "instance", "mesh": "tetrahedron", "transform": [1.2,0,0,0, 0,1.2,0,0, 0,0,1.2,0, 3.5,0.05,-1,1], "material": "glass"},
      {"type": "instance", "mesh": "tetrahedron", "transform": [-1,0,0,0, 0,1,0,0, 0,0,1,0, -1.7,0,4,1]},
      {"type": "mesh", "positions": [4,0,3, 5,0,3, 4.5,1.4,3.2, 4.5,0,4], "indices": [0,1,2, 1,3,2, 3,0,2], "normals": [-1,0,-1, 1,0,-1, 0,1,0, 0,0,1], "material": "red"}],
    "lights": [
      {"type": "point", "position": [5, 8, 5], "intensity": 0.6, "radius": 0.8},
      {"type": "spot", "position": [-5, 7, 5], "direction": [0.6, -1, -0.6], "intensity": 0.5, "exponent": 2, "cutoff": 50, "radius": 0.3},
      {"type": "point", "position": [0, 9, 0], "intensity": 0.2},
      {"type": "rectangle", "corner": [-5, 6, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2], "intensity": 6},
      {"type": "sphere", "center": [0, 5, 6], "radius": 0.7, "intensity": 8},
      {"type": "directional", "direction": [1, -1, -1], "intensity": 0.2, "angular_radius": 3}]},
    "options": {"width": 96, "height": 72, "shadow_samples": 16}})");
}

}  // namespace penumbra::test
