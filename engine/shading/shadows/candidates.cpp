#include "engine/shading/shadows/candidates.h"

#include <algorithm>
#include <numeric>

#include "engine/accel/queries.h"
#include "engine/accel/structure_search.h"
#include "engine/math/error_free.h"

namespace penumbra::shading::shadows {

using namespace accel;

class Candidates::Search {
 public:
  Search(const World& world, const SurfaceId& self, bool leaves_self, std::uint32_t ignored,
         const Projection* projection, std::size_t most_edges, Candidates& found)
      : world_(world),
        self_(self),
        leaves_self_(leaves_self),
        ignored_(ignored),
        projection_(projection),
        most_edges_(most_edges),
        found_(found) {
    found.list_.clear();
    found.silhouette_.clear();
    found.spheres_.clear();
    found.has_opaque_triangles_ = found.is_incomplete_ = found.is_dark_ = false;
  }

  void collect(const Shaft& shaft, const CellContents* among) {
    const OwnedTriangles owned(world_);
    const auto add = [&](std::uint32_t item) { return add_item(shaft, item); };
    const auto add_own = [&](std::uint32_t index, const RegionVisitor::EdgeFlags& edges) {
      return add_triangle(shaft, shaft, world_.triangles, index, edges, owned, projection_, nullptr);
    };
    const auto add_listed = [&](std::uint32_t index) { return add_own(index, {true, true, true}); };
    const bool is_listed = among != nullptr && among->verdict() == CellContents::Verdict::listed;
    const Outline* outline = among == nullptr || projection_ == nullptr ? nullptr : among->outline();
    if (is_listed || outline != nullptr) {
      if (std::ranges::any_of(among->others(), add) || std::ranges::any_of(among->triangles(), add_listed)) return;
      if (outline == nullptr) return;
      if (!outline->spheres.append(*projection_, self_.item, found_.spheres_)) {
        found_.is_dark_ = true;
        return;
      }
      std::erase_if(found_.spheres_, [&](const SeenSphere& sphere) { return sphere.item == ignored_; });
      if (end_if_too_many()) return;
      if (!leaves_self_ && outline->spheres.contains(self_.item) && add(self_.item)) return;
      found_.has_opaque_triangles_ = found_.has_opaque_triangles_ || outline->has_triangles;
      outline->edges.append(*projection_, self_, found_.silhouette_);
      if (found_.silhouette_.size() > most_edges_) keep_edges_in_disc();
      if (found_.silhouette_.size() > most_edges_) found_.is_incomplete_ = true;
      return;
    }
    if (std::ranges::any_of(world_.infinite_items, add)) return;
    search_structure(world_.structure, shaft, projection_, add_own, add);
  }

 private:
  template <class AtTriangle, class AtOther>
  bool search_structure(const Structure& structure, const Shaft& shaft, const Projection* projection,
                        const AtTriangle& at_triangle, const AtOther& at_other) {
    const auto left_out = [&] { found_.has_opaque_triangles_ = true; };
    if (projection == nullptr || !structure.cones)
      return search(structure, shaft.half_spaces(), nullptr, at_triangle, at_other, left_out);
    const Silhouettes silhouettes{*structure.cones, projection->apex, projection->rounding};
    return search(structure, shaft.half_spaces(), &silhouettes, at_triangle, at_other, left_out);
  }

  /// Nothing when the search is over.
  Candidate* add(const SurfaceId& surface, bool is_opaque) {
    if (found_.list_.size() == (projection_ == nullptr ? list_capacity : outline_capacity)) {
      found_.is_incomplete_ = true;
      return nullptr;
    }
    Candidate& candidate = found_.list_.emplace_back();
    candidate.surface = surface, candidate.is_opaque = is_opaque;
    return &candidate;
  }
  /// True when the search is over.
  bool add_other(std::uint32_t item, bool is_opaque) { return add({item, 0}, is_opaque) == nullptr; }

  bool add_triangle(const Shaft& world_shaft, const Shaft& shaft, const TriangleSet& triangles, std::uint32_t index,
                    const RegionVisitor::EdgeFlags& edges, const OwnedTriangles& owned, const Projection* projection,
                    const Placement* placement) {
    const bool is_opaque = owned.is_opaque(index);
    const auto in_world = [&] {
      geometry::TriangleVertices t = triangles[index];
      if (placement == nullptr) return t;
      const math::Affine& map = placement->local_to_world;
      return geometry::TriangleVertices{map.point(t.v0), map.point(t.v1), map.point(t.v2)};
    };
    if (projection != nullptr && is_opaque) {
      const std::array<Vec3, 3> v = projected(triangles, index, *projection);
      if (is_apart(v, projection->is_infinite)) return false;
      // One alone may hide all, and nobody need look for the others.
      if (may_cover(v) && index != owned.index(self_) && world_shaft.is_covered_by(in_world()))
        return found_.is_dark_ = true;
      return add_silhouette(triangles, index, v, edges, owned, *projection);
    }
    const SurfaceId id = owned.surface(index);
    if (id == self_) return false;
    if (projection == nullptr ? shaft.misses(triangles[index])
                              : is_apart(projected(triangles, index, *projection), projection->is_infinite) ||
                                    winding(geometry::TrianglePlane(triangles[index]), *projection) == 0)
      return false;
    const geometry::TriangleVertices t = in_world();
    if (is_opaque && world_shaft.is_covered_by(t)) return found_.is_dark_ = true;
    Candidate* candidate = add(id, is_opaque);
    if (candidate == nullptr) return true;
    candidate->is_triangle = true, candidate->triangle = t;
    return false;
  }

  /// `v`: the triangle's vertices, projected, not apart from the square.
  bool add_silhouette(const TriangleSet& triangles, std::uint32_t index, const std::array<Vec3, 3>& v,
                      const RegionVisitor::EdgeFlags& edges, const OwnedTriangles& owned,
                      const Projection& projection) {
    const std::uint32_t self = owned.index(self_);
    const auto winding_of = [&](std::uint32_t triangle) {
      return triangle == self ? 0 : winding(geometry::TrianglePlane(triangles[triangle]), projection);
    };
    int own = winding_of(index);
    if (own != 0 && reaches_plane(v, projection.is_infinite)) {
      if (meets_cone(v)) return found_.is_incomplete_ = true;
      own = 0;
    }
    if (own != 0) found_.has_opaque_triangles_ = true;
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t other = triangles.neighbours[index][e];
      // The first of two neighbours speaks for their edge.
      if (other < index || !edges[e]) continue;
      const Vec3 &from = v[e], &to = v[(e + 1) % 3];
      if (is_beside_square(from, to) || misses_disc(from, to)) continue;
      const bool is_across = other != TriangleSet::no_neighbour &&
                             !reaches_plane(projected(triangles, other, projection), projection.is_infinite);
      const int jump = jump_at(own, is_across ? winding_of(other) : 0);
      if (jump == 0) continue;
      if (found_.silhouette_.size() == most_edges_ && !has_edges_in_disc_alone_) keep_edges_in_disc();
      if (has_edges_in_disc_alone_ && !is_in_disc(from, to)) continue;
      if (found_.silhouette_.size() == most_edges_) return found_.is_incomplete_ = true;
      found_.silhouette_.push_back({from, to, jump, {owned.surface(index), static_cast<std::uint32_t>(e)}});
    }
    return false;
  }

  /// Whether some of the triangle lies in the disc's plane or beyond it.
  static bool reaches_plane(const std::array<Vec3, 3>& v, bool is_infinite) {
    return !is_infinite && std::max(v[0].z, std::max(v[1].z, v[2].z)) >= 1;
  }

  static std::array<Vec3, 3> projected(const TriangleSet& triangles, std::uint32_t triangle,
                                       const Projection& projection) {
    const auto& [a, b, c] = triangles.corners[triangle];
    return {projection(triangles.positions[a]), projection(triangles.positions[b]), projection(triangles.positions[c])};
  }

  /// Whether the triangle lies on the outer side of a line through the square, behind the apex or beyond the plane.
  static bool is_apart(const std::array<Vec3, 3>& v, bool is_infinite) {
    const auto all = [&](const auto& is_outside) { return is_outside(v[0]) && is_outside(v[1]) && is_outside(v[2]); };
    return all([](const Vec3& p) { return p.x > p.z; }) || all([](const Vec3& p) { return -p.x > p.z; }) ||
           all([](const Vec3& p) { return p.y > p.z; }) || all([](const Vec3& p) { return -p.y > p.z; }) ||
           all([](const Vec3& p) { return p.z < 0; }) || (!is_infinite && all([](const Vec3& p) { return p.z > 1; }));
  }

  /// Whether vertices lie on all sides of the square: what most triangles fail at once.
  static bool may_cover(const std::array<Vec3, 3>& v) {
    const auto any = [&](const auto& is_outside) { return is_outside(v[0]) || is_outside(v[1]) || is_outside(v[2]); };
    return any([](const Vec3& p) { return p.x > p.z; }) && any([](const Vec3& p) { return -p.x > p.z; }) &&
           any([](const Vec3& p) { return p.y > p.z; }) && any([](const Vec3& p) { return -p.y > p.z; });
  }

  /// Only of those it may depend whether there are too many: others are found or not with the structure.
  void keep_edges_in_disc() {
    std::erase_if(found_.silhouette_, [](const SilhouetteEdge& edge) { return !is_in_disc(edge.from, edge.to); });
    has_edges_in_disc_alone_ = true;
  }

  /// True if there are too many spheres to go on.
  bool end_if_too_many() {
    return found_.is_incomplete_ = found_.is_incomplete_ || found_.spheres_.size() > outline_capacity;
  }

  bool add_sphere(const geometry::SphereShape& sphere, std::uint32_t id, bool is_opaque) {
    const InCone place = place_in(*projection_, sphere);
    if (place == InCone::apart) return false;
    if (id == self_.item || !is_opaque) return add_other(id, is_opaque);
    if (place == InCone::covers_it) return found_.is_dark_ = true;
    found_.spheres_.emplace_back(sphere, projection_->apex, id);
    return end_if_too_many();
  }

  bool add_item(const Shaft& shaft, std::uint32_t id) {
    if (id == ignored_) return false;
    const Item& item = world_.items[id];
    if (item.kind == Kind::mesh) {
      if (item.placement == no_placement) return add_mesh(shaft, shaft, id, projection_, nullptr);
      const Placement& placement = world_.placements[item.placement];
      if (projection_ == nullptr) return add_mesh(shaft, shaft.in_space_of(placement), id, nullptr, &placement);
      const math::Affine& map = placement.local_to_world;
      const Projection local{
          placement.world_to_local.point(projection_->apex),
          map.transposed_vector(projection_->x),
          map.transposed_vector(projection_->y),
          map.transposed_vector(projection_->w),
          projection_->is_infinite,
          accel::rounding_after(placement.world_to_local, math::abs(projection_->apex), projection_->rounding),
          {}};
      return add_mesh(shaft, shaft.in_space_of(placement), id, &local, &placement);
    }
    if (id == self_.item && ((leaves_self_ && is_convex(item.kind)) || item.kind == Kind::plane)) return false;
    if (item.placement == no_placement) {
      if (item.kind == Kind::plane && shaft.misses(world_.planes[item.index])) return false;
      if (item.kind == Kind::cylinder) {
        const geometry::CylinderShape& cylinder = world_.cylinders[item.index];
        if (shaft.misses(cylinder)) return false;
        // Whether such a one lies beside the disc is told by its cover, whatever boxes there are.
        if (projection_ != nullptr && item.is_opaque && cylinder.caps && is_before_plane(cylinder))
          return add_other(id, item.is_opaque);
      }
      if (item.kind == Kind::tube && shaft.misses(world_.tubes[item.index])) return false;
      if (item.kind == Kind::sphere) {
        const geometry::SphereShape& sphere = world_.spheres[item.index];
        if (projection_ != nullptr) return add_sphere(sphere, id, item.is_opaque);
        if (shaft.misses(sphere)) return false;
        if (item.is_opaque && id != self_.item && covers(shaft, sphere)) return found_.is_dark_ = true;
        return add_other(id, item.is_opaque);
      }
    }
    // What boxes around it would reject: so the answer does not depend on which there are.
    if (const auto box = bounds_of(world_, item); box && shaft.misses(*box)) return false;
    return add_other(id, item.is_opaque);
  }

  /// For certain.
  bool is_before_plane(const geometry::CylinderShape& cylinder) const {
    if (projection_->is_infinite) return true;
    const double base = math::dot(projection_->w, cylinder.base - projection_->apex),
                 top = base + math::dot(projection_->w, cylinder.axis) * cylinder.height;
    return std::max(base, top) + cylinder.radius * math::length(projection_->w) < 1 - math::gamma(128);
  }

  bool add_mesh(const Shaft& world_shaft, const Shaft& shaft, std::uint32_t id, const Projection* projection,
                const Placement* placement) {
    const MeshShape& mesh = world_.meshes[world_.items[id].index];
    const OwnedTriangles owned(world_, id);
    return search_structure(
        mesh.structure, shaft, world_.items[id].is_opaque ? projection : nullptr,
        [&](std::uint32_t index, const RegionVisitor::EdgeFlags& edges) {
          return add_triangle(world_shaft, shaft, mesh.triangles, index, edges, owned, projection, placement);
        },
        [](std::uint32_t) { return false; });
  }

  static bool covers(const Shaft& shaft, const geometry::SphereShape& sphere) {
    if (shaft.is_infinite()) return false;
    Vec3 axis;
    for (const Vec3& edge : shaft.edges()) axis += edge * 0.25;
    double radius = 0;
    for (const Vec3& edge : shaft.edges()) radius = std::max(radius, math::length(edge - axis));
    return ViewCone::around(axis, radius, false).is_covered_by(sphere.center - shaft.apex(), sphere.radius);
  }

  const World& world_;
  SurfaceId self_;
  bool leaves_self_;
  std::uint32_t ignored_;
  const Projection* projection_;
  std::size_t most_edges_;
  bool has_edges_in_disc_alone_ = false;
  Candidates& found_;
};

std::size_t Candidates::drop_hidden_spheres() {
  const std::size_t count = spheres_.size();
  drop_hidden(spheres_);
  return count - spheres_.size();
}

std::span<const std::uint32_t> Candidates::scene_order() {
  order_.resize(list_.size());
  std::iota(order_.begin(), order_.end(), 0u);
  const auto surface = [&](std::uint32_t i) { return list_[i].surface; };
  if (!std::ranges::is_sorted(order_, {}, surface)) std::ranges::sort(order_, {}, surface);
  return order_;
}

void Candidates::gather(const World& world, const Shaft& shaft, const SurfaceId& self, bool leaves_self,
                        const CellContents* among, std::uint32_t ignored) {
  Search(world, self, leaves_self, ignored, nullptr, 0, *this).collect(shaft, among);
}

void Candidates::gather_silhouettes(const World& world, const Shaft& shaft, const Projection& projection,
                                    const SurfaceId& self, bool leaves_self, const CellContents* among,
                                    std::size_t most_edges, std::uint32_t ignored) {
  Search(world, self, leaves_self, ignored, &projection, most_edges, *this).collect(shaft, among);
}

}  // namespace penumbra::shading::shadows
