#include "engine/accel/shaft.h"

#include <algorithm>
#include <cmath>

#include "engine/accel/queries.h"
#include "engine/accel/tree.h"
#include "engine/accel/wide_walk.h"
#include "engine/math/error_free.h"

namespace penumbra::accel {
namespace {

using math::abs;
using math::dot;
using math::gamma;

double taxicab(const Vec3& v) { return std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z); }

/// The plane of a triangle, scaled, and which side a point is on for certain.
struct TrianglePlane {
  Vec3 origin, normal;
  double size;

  explicit TrianglePlane(const geometry::TriangleVertices& t)
      : origin(t.v0),
        normal(math::cross(t.v1 - t.v0, t.v2 - t.v0)),
        size(taxicab(t.v1 - t.v0) * taxicab(t.v2 - t.v0)) {}
  /// +1, −1, or 0 when rounding decides. `offset` = x − origin; `magnitude` bounds the coordinates it was taken from.
  int side(const Vec3& offset, double magnitude) const {
    const double value = dot(normal, offset), error = gamma(16) * size * (taxicab(offset) + magnitude);
    return value > error ? 1 : value < -error ? -1 : 0;
  }
};

}  // namespace

Shaft::Shaft(const Vec3& apex, const std::array<Vec3, 4>& corners, bool is_infinite)
    : apex_(apex), corners_(corners), is_infinite_(is_infinite) {
  bounds_.include(apex);
  double reach = taxicab(apex);
  Vec3 middle;
  for (std::size_t i = 0; i < 4; ++i) {
    edges_[i] = is_infinite ? corners[i] : corners[i] - apex;
    middle += edges_[i] * 0.25;
    reach = std::max(reach, taxicab(corners[i]));
    if (!is_infinite) {
      bounds_.include(corners[i]);
      continue;
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (edges_[i][axis] > 0) bounds_.upper[axis] = HUGE_VAL;
      if (edges_[i][axis] < 0) bounds_.lower[axis] = -HUGE_VAL;
    }
  }
  // A plane through the apex and two corners is off by a few roundings of their coordinates anywhere in the shaft.
  const auto add_side = [&](const Vec3& outward, double offset) {
    sides_[static_cast<std::size_t>(side_count_++)] = {outward, abs(outward), offset,
                                                       gamma(64) * taxicab(outward) * reach};
  };
  side_count_ = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    Vec3 outward = math::cross(edges_[i], edges_[(i + 1) % 4]);
    if (dot(outward, middle) > 0) outward = -outward;
    add_side(outward, 0);
  }
  Vec3 forward = middle;
  if (!is_infinite) {
    forward = math::cross(corners[1] - corners[0], corners[3] - corners[0]);
    if (dot(forward, middle) < 0) forward = -forward;
    double farthest = 0;
    for (const Vec3& edge : edges_) farthest = std::max(farthest, dot(forward, edge));
    add_side(forward, farthest);
  }
  add_side(-forward, 0);
  const Vec3 margin = abs(apex) * gamma(8) + Vec3{reach, reach, reach} * gamma(8);
  bounds_.lower = bounds_.lower - margin;
  bounds_.upper = bounds_.upper + margin;
}

Shaft Shaft::in_space_of(const Placement& placement) const {
  const math::Affine& map = placement.world_to_local;
  std::array<Vec3, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = is_infinite_ ? map.vector(corners_[i]) : map.point(corners_[i]);
  return {map.point(apex_), corners, is_infinite_};
}

bool Shaft::is_apart(const Vec3& lower, const Vec3& upper) const {
  return lower.x > bounds_.upper.x || upper.x < bounds_.lower.x || lower.y > bounds_.upper.y ||
         upper.y < bounds_.lower.y || lower.z > bounds_.upper.z || upper.z < bounds_.lower.z;
}

bool Shaft::misses(const math::Bounds& box) const {
  if (is_apart(box.lower, box.upper)) return true;
  const Vec3 half = box.extent() * 0.5, centre = box.centre() - apex_;
  for (int i = 0; i < side_count_; ++i) {
    const Side& side = sides_[static_cast<std::size_t>(i)];
    const double radius = dot(side.size, half);
    if (dot(side.outward, centre) - radius > side.offset + side.slack + gamma(32) * radius) return true;
  }
  return false;
}

Shaft::BoxPlanes Shaft::box_planes(const Vec3& origin) const {
  BoxPlanes result;
  result.count = side_count_;
  for (int axis = 0; axis < 3; ++axis) {
    result.lower[axis] = rounded_down(bounds_.lower[axis] - origin[axis]);
    result.upper[axis] = rounded_up(bounds_.upper[axis] - origin[axis]);
  }
  for (int i = 0; i < side_count_; ++i) {
    const Side& side = sides_[static_cast<std::size_t>(i)];
    // Normals scaled to 1, so that products of single precision neither overflow nor vanish.
    const double scale = 1 / std::max(math::max_component(side.size), 1e-300);
    BoxPlanes::Plane& plane = result.plane[i];
    const Vec3 apex = apex_ - origin;
    const double offset = side.offset + dot(side.outward, apex);
    for (int axis = 0; axis < 3; ++axis) {
      plane.outward[axis] = static_cast<float>(side.outward[axis] * scale);
      plane.nearest_row[axis] = plane.outward[axis] > 0 ? axis : axis + 3;
    }
    plane.offset = static_cast<float>(offset * scale);
    plane.slack =
        static_cast<float>((side.slack + 8 * 0x1p-24 * (std::fabs(offset) + dot(side.size, abs(apex)))) * scale);
  }
  return result;
}

bool Shaft::misses(const geometry::TriangleVertices& triangle) const {
  // What the triangle's own box would reject: so the answer does not depend on the boxes around it.
  const Vec3 lower = math::min(triangle.v0, math::min(triangle.v1, triangle.v2));
  const Vec3 upper = math::max(triangle.v0, math::max(triangle.v1, triangle.v2));
  if (is_apart(lower, upper)) return true;
  const Vec3 a = triangle.v0 - apex_, b = triangle.v1 - apex_, c = triangle.v2 - apex_;
  const Vec3 size = math::max(abs(a), math::max(abs(b), abs(c)));
  for (int i = 0; i < side_count_; ++i) {
    const Side& side = sides_[static_cast<std::size_t>(i)];
    const double threshold = side.offset + side.slack + gamma(32) * dot(side.size, size);
    if (dot(side.outward, a) > threshold && dot(side.outward, b) > threshold && dot(side.outward, c) > threshold)
      return true;
  }
  const TrianglePlane plane(triangle);
  const double magnitude = taxicab(apex_) + taxicab(triangle.v0);
  const int side = plane.side(-a, magnitude);
  // From a point in the triangle's plane the triangle is seen edge-on: its own test finds no crossing either.
  if (side == 0) return true;
  for (const Vec3& edge : edges_) {
    const int other = is_infinite_ ? plane.side(edge, taxicab(edge)) : plane.side(edge - a, magnitude + taxicab(edge));
    // Towards infinity only a direction that leads away from the plane (or along it) stays on this side.
    if (other != side) return false;
  }
  return true;
}

bool Shaft::misses(const geometry::SphereShape& sphere) const {
  const Vec3 reach{sphere.radius, sphere.radius, sphere.radius};
  if (is_apart(sphere.center - reach, sphere.center + reach)) return true;
  const Vec3 centre = sphere.center - apex_;
  for (int i = 0; i < side_count_; ++i) {
    const Side& side = sides_[static_cast<std::size_t>(i)];
    const double radius = math::length(side.outward) * sphere.radius;
    if (dot(side.outward, centre) - radius >
        side.offset + side.slack + gamma(32) * (radius + dot(side.size, abs(centre))))
      return true;
  }
  return false;
}

bool Shaft::misses(const geometry::PlaneShape& plane) const {
  const double height = dot(plane.normal, apex_ - plane.point);
  const double error = gamma(16) * dot(abs(plane.normal), abs(apex_) + abs(plane.point));
  // From a point in the plane no segment crosses it.
  if (std::fabs(height) <= error) return true;
  return std::all_of(edges_.begin(), edges_.end(), [&](const Vec3& edge) {
    const double slope = dot(plane.normal, edge), end = is_infinite_ ? slope : height + slope;
    return (height > 0 ? end : -end) > error + gamma(16) * dot(abs(plane.normal), abs(edge));
  });
}

bool Shaft::misses(const geometry::TubeShape& tube) const {
  if (is_infinite_) return false;
  // Across the axis the tube is a disc around 0 and the shaft the hull of five points: they are apart if the point of
  // the hull's outline nearest to 0 is farther than the radius and the whole hull lies behind it.
  std::array<Vec3, 5> points;
  double size = tube.radius + taxicab(apex_) + taxicab(tube.point);
  for (std::size_t i = 0; i < 5; ++i) {
    const Vec3 p = (i < 4 ? corners_[i] : apex_) - tube.point;
    points[i] = p - tube.axis * dot(p, tube.axis);
    size = std::max(size, taxicab(p));
  }
  Vec3 nearest = points[0];
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = i + 1; k < 5; ++k) {
      const Vec3 along = points[k] - points[i];
      const double squared = dot(along, along);
      const double t = squared > 0 ? std::clamp(-dot(points[i], along) / squared, 0.0, 1.0) : 0;
      const Vec3 q = points[i] + along * t;
      if (dot(q, q) < dot(nearest, nearest)) nearest = q;
    }
  }
  const double distance = math::length(nearest), error = gamma(64) * size;
  if (!(distance > tube.radius + error)) return false;
  return std::all_of(points.begin(), points.end(),
                     [&](const Vec3& p) { return dot(p, nearest) > (tube.radius + error) * distance; });
}

bool Shaft::is_covered_by(const geometry::TriangleVertices& triangle) const {
  const Vec3 vertex[3]{triangle.v0 - apex_, triangle.v1 - apex_, triangle.v2 - apex_};
  const TrianglePlane plane(triangle);
  const double magnitude = taxicab(apex_) + taxicab(triangle.v0);
  const int side = plane.side(-vertex[0], magnitude);
  if (side == 0) return false;
  for (const Vec3& edge : edges_) {
    const int other = is_infinite_ ? plane.side(edge, 0) : plane.side(edge - vertex[0], magnitude + taxicab(edge));
    if (other != -side) return false;
  }
  for (int i = 0; i < 3; ++i) {
    const Vec3 &from = vertex[i], &to = vertex[(i + 1) % 3];
    const Vec3 inward = math::cross(from, to) * -static_cast<double>(side);
    const double size = taxicab(from) * taxicab(to) + magnitude * (taxicab(from) + taxicab(to));
    for (const Vec3& edge : edges_) {
      if (!(dot(inward, edge) > gamma(16) * size * taxicab(edge))) return false;
    }
  }
  return true;
}

namespace {

/// Calls at_triangle(index) and at_other(item) for what the shaft may meet, until one returns true.
template <class AtTriangle, class AtOther>
bool search(const Structure& structure, const Shaft& shaft, const AtTriangle& at_triangle, const AtOther& at_other) {
  if (structure.wide) {
    struct Visitor final : ShaftVisitor {
      Visitor(const AtTriangle& t, const AtOther& o) : at_triangle(t), at_other(o) {}
      bool triangle(std::uint32_t index) override { return at_triangle(index); }
      bool other(std::uint32_t item) override { return at_other(item); }
      const AtTriangle& at_triangle;
      const AtOther& at_other;
    } visitor(at_triangle, at_other);
    return walk(*structure.wide, shaft, visitor);
  }
  const Tree& tree = *structure.plain;
  const auto misses = [&](const math::Bounds& box) { return shaft.misses(box); };
  auto at_leaf = [&](const Tree::Node& leaf) {
    return std::ranges::any_of(tree.triangles(leaf), at_triangle) || std::ranges::any_of(tree.others(leaf), at_other);
  };
  return !misses(tree.root().box) && visit(tree, tree.root(), misses, at_leaf);
}

}  // namespace

class Candidates::Search {
 public:
  Search(const World& world, const SurfaceId& self, bool leaves_self, Candidates& found)
      : world_(world), self_(self), leaves_self_(leaves_self), found_(found) {}

  void collect(const Shaft& shaft) {
    const auto add_items = [&](const auto& items) {
      for (const std::uint32_t item : items) {
        if (add_item(shaft, item)) return true;
      }
      return false;
    };
    if (add_items(world_.infinite_items)) return;
    search(
        world_.structure, shaft,
        [&](std::uint32_t index) {
          return add_triangle(shaft, shaft, world_.triangles[index], OwnedTriangles(world_).surface(index), nullptr);
        },
        [&](std::uint32_t item) { return add_item(shaft, item); });
  }

 private:
  /// True when the search is over.
  bool add(const Candidate& candidate) {
    if (found_.count_ == capacity) return found_.has_overflowed_ = true;
    found_.list_[static_cast<std::size_t>(found_.count_++)] = candidate;
    return false;
  }

  bool add_triangle(const Shaft& world_shaft, const Shaft& shaft, const geometry::TriangleVertices& triangle,
                    SurfaceId id, const Placement* placement) {
    if (id == self_ || shaft.misses(triangle)) return false;
    Candidate candidate{id, world_.items[id.item].is_opaque, true, triangle};
    if (placement != nullptr) {
      const math::Affine& map = placement->local_to_world;
      candidate.triangle = {map.point(triangle.v0), map.point(triangle.v1), map.point(triangle.v2)};
    }
    if (candidate.is_opaque && world_shaft.is_covered_by(candidate.triangle)) return found_.is_dark_ = true;
    return add(candidate);
  }

  bool add_item(const Shaft& shaft, std::uint32_t id) {
    const Item& item = world_.items[id];
    if (item.kind == Kind::mesh) {
      if (item.placement == not_placed) return add_mesh(shaft, shaft, id, nullptr);
      const Placement& placement = world_.placements[item.placement];
      return add_mesh(shaft, shaft.in_space_of(placement), id, &placement);
    }
    if (id == self_.item && (leaves_self_ || item.kind == Kind::plane)) return false;
    if (item.placement == not_placed) {
      if (item.kind == Kind::plane && shaft.misses(world_.planes[item.index])) return false;
      if (item.kind == Kind::tube && shaft.misses(world_.tubes[item.index])) return false;
      if (item.kind == Kind::sphere) {
        if (shaft.misses(world_.spheres[item.index])) return false;
        if (item.is_opaque && !shaft.is_infinite() && id != self_.item && covers(shaft, id))
          return found_.is_dark_ = true;
      }
    }
    if (const auto box = bounds_of(world_, item); box && shaft.misses(*box)) return false;
    return add({{id, 0}, item.is_opaque, false, {}});
  }

  bool add_mesh(const Shaft& world_shaft, const Shaft& shaft, std::uint32_t id, const Placement* placement) {
    const MeshShape& mesh = world_.meshes[world_.items[id].index];
    return search(
        mesh.structure, shaft,
        [&](std::uint32_t part) {
          return add_triangle(world_shaft, shaft, mesh.triangles[part], {id, part}, placement);
        },
        [](std::uint32_t) { return false; });
  }

  /// Seen from outside, the segments that cross a convex body end in a convex set: four corners inside it prove all.
  bool covers(const Shaft& shaft, std::uint32_t id) const {
    const geometry::SphereShape& sphere = world_.spheres[world_.items[id].index];
    if (!(math::length(shaft.apex() - sphere.center) > sphere.radius)) return false;
    for (const Vec3& edge : shaft.edges()) {
      if (count_crossings(world_, id, {shaft.apex(), edge, {}}, 1) == 0) return false;
    }
    return true;
  }

  const World& world_;
  SurfaceId self_;
  bool leaves_self_;
  Candidates& found_;
};

void Candidates::gather(const World& world, const Shaft& shaft, const SurfaceId& self, bool leaves_self) {
  count_ = 0;
  has_overflowed_ = is_dark_ = false;
  Search(world, self, leaves_self, *this).collect(shaft);
}

}  // namespace penumbra::accel
