#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/accel/world.h"
#include "engine/shading/shadows/cell.h"
#include "engine/shading/shadows/shaft.h"
#include "engine/shading/shadows/silhouettes.h"
#include "engine/shading/shadows/sphere_list.h"

namespace penumbra::shading::shadows {

/// Something that may cross the shaft.
struct Candidate {
  SurfaceId surface;
  bool is_opaque = true;
  bool is_triangle = false;
  geometry::TriangleVertices triangle;  // in world space; only if is_triangle
};

/// What may cross a shaft; made to be gathered again and again without allocating. Not to be shared.
class Candidates {
 public:
  /// Finds every surface that a segment from the apex into the shaft's quadrilateral may cross, up to `list_capacity`.
  /// `self` is what the apex lies on: a flat surface is left out, and with `leaves_self` a curved one too – when every
  /// segment leaves it on its outer side, it cannot meet a convex shape again. With `among`, the contents of a cell
  /// that holds the apex and of a target that holds the quadrilateral's samples: only what is listed there is looked
  /// at, and among its edges. The item `ignored` counts for nothing.
  void gather(const World& world, const Shaft& shaft, const SurfaceId& self, bool leaves_self,
              const CellContents* among = nullptr, std::uint32_t ignored = accel::no_item);

  /// As `gather`, but of opaque triangles only the silhouette: the edges in sight that do not lie between two triangles
  /// side by side. Laine, Aila, Assarsson, Lehtinen, Akenine-Möller, "Soft Shadow Volumes for Ray Tracing", SIGGRAPH
  /// 2005. Opaque spheres that are neither placed nor `self` are not in the list but in `spheres`. More edges than
  /// `most_edges` are of no use.
  void gather_silhouettes(const World& world, const Shaft& shaft, const Projection& projection, const SurfaceId& self,
                          bool leaves_self, const CellContents* among = nullptr, std::size_t most_edges = 16384,
                          std::uint32_t ignored = accel::no_item);

  std::span<const Candidate> list() const { return list_; }
  std::span<const SeenSphere> spheres() const { return spheres_; }
  /// Drops spheres that larger ones hide; returns how many.
  std::size_t drop_hidden_spheres();
  /// In the structure's order; edges beside the disc may be among them.
  std::span<const SilhouetteEdge> silhouette() const { return silhouette_; }
  /// Places in the list, which is in the structure's order, by the scene's.
  std::span<const std::uint32_t> scene_order();
  /// Some opaque triangle may be in the shaft, though it need not show a silhouette.
  bool has_opaque_triangles() const { return has_opaque_triangles_; }
  /// Nothing crosses the shaft, opaque triangles without a silhouette aside.
  bool is_empty() const { return list_.empty() && spheres_.empty() && silhouette_.empty() && !is_incomplete_; }
  /// The list is of no use: too much may cross the shaft, or (of a silhouette) a triangle crosses its far plane.
  bool is_incomplete() const { return is_incomplete_; }
  /// One opaque surface crosses every segment of the shaft.
  bool is_dark() const { return is_dark_; }

 private:
  class Search;
  static constexpr std::size_t list_capacity = 48, outline_capacity = 1024;
  std::vector<Candidate> list_;
  std::vector<std::uint32_t> order_;
  std::vector<SeenSphere> spheres_;
  std::vector<SilhouetteEdge> silhouette_;
  bool has_opaque_triangles_ = false, is_incomplete_ = false, is_dark_ = false;
};

}  // namespace penumbra::shading::shadows
