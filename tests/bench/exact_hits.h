#pragma once
#include <embree3/rtcore.h>

#include <optional>

#include "tests/bench/surface_hit.h"

namespace penumbra::bench {

/// Shapes, and the largest coordinate of what rays to them are rounded by, if it is not their own.
template <class Shape>
struct ExactShapes {
  const std::vector<Shape>* list;
  double extent = 0;
};

/// The closest hit in double precision: Embree finds the boxes, the shapes are met by textbook formulas. For reference
/// images, in which a pixel on the wrong side of an edge would count more than all noise.
class ExactHits {
 public:
  explicit ExactHits(const FlatScene& flat);
  ~ExactHits();
  ExactHits(const ExactHits&) = delete;
  ExactHits& operator=(const ExactHits&) = delete;

  /// `from` is the surface the ray leaves, if any: it is not met within `least` of the origin.
  std::optional<SurfaceHit> closest(const Vec3& origin, const Vec3& direction, double least) const;

 private:
  const FlatScene& flat_;
  ExactShapes<FlatTriangle> triangles_;
  ExactShapes<FlatSphere> spheres_;
  ExactShapes<FlatCylinder> cylinders_;
  std::vector<ExactShapes<FlatTriangle>> meshes_;
  RTCDevice device_;
  RTCScene scene_;
  std::vector<RTCScene> mesh_scenes_;
};

}  // namespace penumbra::bench
