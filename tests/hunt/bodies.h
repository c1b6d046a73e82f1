#pragma once
#include <cstdint>
#include <vector>

#include "engine/math/constants.h"
#include "engine/scene/description.h"

namespace penumbra::hunt {

using math::Affine;
using math::Color;
using math::Vec3;

/// The oracle's own coordinates: the camera is the origin, and what it looks at is a few units away, whatever the
/// scene's scale and however far off it lies.
struct Frame {
  Vec3 center;
  double scale = 1;

  explicit Frame(const scene::Description& scene);
  /// After `placement`, in more digits than the scene's numbers have.
  Vec3 point(const Vec3& p, const Affine& placement = {}) const;
};

/// Where a line meets a body; `part`, `u` and `v` are for `Bodies::normals_at` alone.
struct Crossing {
  double t = 0;
  std::uint32_t body = 0, part = 0;
  double u = 0, v = 0;
};

struct Normals {
  Vec3 geometric;  // unit, outward
  Vec3 shading;    // unit
};

/// The objects of a scene one by one, in the scene's order, in the coordinates of a Frame.
class Bodies {
 public:
  Bodies(const scene::Description& scene, const Frame& frame);

  std::size_t size() const { return bodies_.size(); }
  const scene::Material& material(std::size_t body) const { return *bodies_[body].material; }
  /// Adds every place at which origin + t·direction meets the body, whatever the sign of t.
  void meet(std::size_t body, const Vec3& origin, const Vec3& direction, std::vector<Crossing>& found) const;
  Normals normals_at(const Crossing& crossing, const Vec3& origin, const Vec3& direction) const;

 private:
  enum class Kind { sphere, tube, cylinder, plane, triangles, polygon };
  struct Face {
    Vec3 corner, edge_u, edge_v, normal;
    Vec3 smooth[3];  // at the corners; all zero when flat
  };
  struct Body {
    Kind kind{};
    const scene::Material* material = nullptr;
    Affine to_local;  // of round ones, where they are of unit size around the z axis
    bool caps = false;
    Vec3 point, normal;  // of what is flat
    std::vector<Vec3> outline;
    std::vector<Face> faces;
    Vec3 middle;
    double reach = math::infinity;
  };
  void add(const scene::Description& scene, const scene::Object& object, const Affine& placement);
  void add_round(Kind kind, const Vec3& base, const Vec3& axis, double radius, double height, const Affine& placement);
  void add_mesh(const scene::Mesh& mesh, const Affine& placement);
  void add_polygon(const std::vector<Vec3>& vertices, const Affine& placement);
  void enclose(const std::vector<Vec3>& points);

  const Frame& frame_;
  std::vector<Body> bodies_;
};

}  // namespace penumbra::hunt
