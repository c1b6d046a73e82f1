#include "engine/shading/shadows/cell.h"

#include <algorithm>
#include <cmath>

#include "engine/accel/structure_search.h"
#include "engine/math/constants.h"
#include "engine/math/error_free.h"
#include "engine/shading/shadows/view_cone.h"

namespace penumbra::shading::shadows {

using namespace accel;
namespace {

using math::abs;
using math::dot;
using math::gamma;

/// The ball, or what holds the directions, relative to a point.
Vec3 towards(const Target& target, const Vec3& from) {
  return target.is_infinite ? target.center : target.center - from;
}

RoundCell around(const FlatCell& cell) {
  const Vec3 center = (cell.corners[0] + cell.corners[2]) * 0.5;
  double radius = 0;
  for (const Vec3& corner : cell.corners) radius = std::max(radius, math::length(corner - center));
  return {center, radius * (1 + gamma(64))};
}

/// A bound of every coordinate that takes part.
double reach_of(const FlatCell& cell, const Target& target) {
  double reach = math::max_component(abs(target.center)) + target.radius;
  for (const Vec3& corner : cell.corners) reach = std::max(reach, math::max_component(abs(corner)));
  return 3 * reach;
}

void include(const Target& target, int axis, math::Bounds& bounds) {
  const double least = target.center[axis] - target.radius, most = target.center[axis] + target.radius;
  if (!target.is_infinite) {
    bounds.lower[axis] = std::min(bounds.lower[axis], least), bounds.upper[axis] = std::max(bounds.upper[axis], most);
  } else {
    if (least < 0) bounds.lower[axis] = -math::infinity;
    if (most > 0) bounds.upper[axis] = math::infinity;
  }
}

/// Whether no part of an item that is no patch is in the region, as far as its sphere, cylinder or box tells.
bool misses(const HalfSpaces& region, const World& world, const Item& item) {
  if (item.placement == no_placement) {
    if (item.kind == Kind::sphere) return region.miss(world.spheres[item.index]);
    if (item.kind == Kind::cylinder && region.miss(world.cylinders[item.index])) return true;
  }
  const auto box = bounds_of(world, item);
  return box && region.miss(*box);
}

/// Ends the region behind the target and the viewpoints, and limits it to what lies before the target's middle, or
/// its lead, as all viewpoints see it. The region's base is the middle of the viewpoints.
void add_ends(HalfSpaces& region, const Target& target, const RoundCell& viewpoints) {
  if (target.is_infinite) return;
  const Vec3 way = target.center - viewpoints.center;
  const double distance = math::length(way);
  const math::Frame frame = math::frame_around(way * (1 / distance));
  region.add(frame.n, std::max(dot(frame.n, way) + target.radius, viewpoints.radius));
  // The viewpoints' ways to the middle lie in a cone, and that within these four.
  const double sine = viewpoints.radius / distance, tangent = 1.001 * sine / std::sqrt(1 - sine * sine);
  for (const double u : {-tangent, tangent}) {
    for (const double v : {-tangent, tangent}) {
      const Vec3 outward = frame.n + frame.u * u + frame.v * v;
      region.add_limit(outward, dot(outward, way) - target.lead * math::length(outward));
    }
  }
}

}  // namespace

std::optional<HalfSpaces> hull(const FlatCell& cell, const Target& target) {
  const double reach = reach_of(cell, target), rounding = gamma(64) * reach;
  math::Bounds bounds;
  for (const Vec3& corner : cell.corners) bounds.include(corner);
  for (int axis = 0; axis < 3; ++axis) include(target, axis, bounds);
  const Vec3 base = (cell.corners[0] + cell.corners[2]) * 0.5;
  HalfSpaces region(base, reach, bounds);
  const double r = target.radius;
  for (std::size_t i = 0; i < 4; ++i) {
    // The plane through an edge that touches the target: in the coordinates m, across the edge, and f, up from the cell
    // (both perpendicular to the edge), a tangent from the origin to a circle around q.
    const Vec3 &from = cell.corners[i], &to = cell.corners[(i + 1) % 4];
    Vec3 m = math::normalize_or(math::cross(to - from, cell.up), {});
    if (m == Vec3{}) return std::nullopt;  // far away a small cell's corners may round to one point
    if (dot(m, from - base) < 0) m = -m;
    const Vec3 q = towards(target, from);
    const double qm = dot(q, m), qf = dot(q, cell.up);
    if (!(qf > 1.01 * r + rounding)) return std::nullopt;  // keeps s well away from 0
    const double squared = qm * qm + qf * qf, s = std::sqrt(squared - r * r);
    const Vec3 outward = (m * (s * qf - r * qm) - cell.up * (r * qf + s * qm)) * (1 / squared);
    region.add(outward, dot(outward, from - base));
  }
  double nearby = 0;
  for (const Vec3& corner : cell.corners) nearby = std::max(nearby, math::max_component(abs(corner)));
  region.add_floor(cell.up, 3 * nearby);
  add_ends(region, target, around(cell));
  return region;
}

std::optional<HalfSpaces> hull(const RoundCell& cell, const Target& target) {
  const double R = cell.radius, r = target.radius;
  const Vec3 to_target = towards(target, cell.center);
  const double distance = math::length(to_target);
  if (!(distance > 1.01 * (target.is_infinite ? r : R + r))) return std::nullopt;
  const double reach = 3 * (math::max_component(abs(cell.center)) + math::max_component(abs(target.center)) + R + r);
  math::Bounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    bounds.lower[axis] = cell.center[axis] - R, bounds.upper[axis] = cell.center[axis] + R;
    include(target, axis, bounds);
  }
  HalfSpaces region(cell.center, reach, bounds);
  const Vec3 forward = to_target * (1 / distance);
  // Planes that touch both balls: outward·(center of the target − center of the cell) = R − r. Infinitely far, the
  // balls' difference counts for nothing, and r is the sine of an angle.
  const double sine = (target.is_infinite ? -r : R - r) / distance, cosine = std::sqrt(1 - sine * sine);
  const math::Frame frame = math::frame_around(forward);
  for (const Vec3& side : {frame.u, frame.v, -frame.u, -frame.v}) region.add(side * cosine + forward * sine, R);
  region.add(-forward, R);
  add_ends(region, target, cell);
  return region;
}

class CellContents::Search {
 public:
  Search(const World& world, const FlatCell& cell, const Target& target, const SurfaceId& self, CellContents& found)
      : world_(world),
        cell_(cell),
        target_(target),
        self_(self),
        found_(found),
        reach_(reach_of(cell, target)),
        least_cover_(least_cover(cell, target)) {}

  Verdict run() {
    const std::optional<HalfSpaces> region = hull(cell_, target_);
    if (!region) return Verdict::unknown;
    const OwnedTriangles owned(world_);
    const std::uint32_t self_triangle = owned.index(self_);
    const auto at_other = [&](std::uint32_t item) { return add_other(*region, item); };
    const auto at_triangle = [&](std::uint32_t triangle, const RegionVisitor::EdgeFlags&) {
      if (triangle == self_triangle || region->miss(world_.triangles[triangle])) return false;
      if (owned.is_opaque(triangle) && covers(world_.triangles[triangle])) return is_dark_ = true;
      if (found_.triangle_count_ < triangle_capacity) found_.triangles_[found_.triangle_count_++] = triangle;
      return count_met();
    };
    std::ranges::any_of(world_.infinite_items, at_other) ||
        search(world_.structure, *region, nullptr, at_triangle, at_other, [] {});
    if (is_dark_) return Verdict::dark;
    if (met_ > found_.triangle_count_ + found_.others_.size() || found_.others_.size() > listed_others)
      return Verdict::unknown;
    return met_ == 0 ? Verdict::lit : Verdict::listed;
  }

 private:
  bool add_other(const HalfSpaces& region, std::uint32_t id) {
    const Item& item = world_.items[id];
    if (item.kind == Kind::plane && (id == self_.item || is_beside(world_.planes[item.index]))) return false;
    if (misses(region, world_, item)) return false;
    if (item.kind == Kind::sphere && item.placement == no_placement && item.is_opaque &&
        covers(world_.spheres[item.index]))
      return is_dark_ = true;
    if (found_.others_.size() <= listed_others) found_.others_.push_back(id);
    return count_met();
  }

  /// True if with it there is no hope left to find that one surface hides all.
  bool count_met() { return ++met_ == patience; }

  /// Cell and target are wholly on one side of a plane.
  bool is_beside(const geometry::PlaneShape& plane) const {
    const double error = gamma(64) * (reach_ + math::max_component(abs(plane.point)));
    const double end =
        target_.is_infinite ? dot(plane.normal, target_.center) : dot(plane.normal, target_.center - plane.point);
    const double side = end < 0 ? -1 : 1;
    return side * end > target_.radius + error && std::ranges::all_of(cell_.corners, [&](const Vec3& corner) {
             return side * dot(plane.normal, corner - plane.point) > error;
           });
  }

  /// Between cell and target their hull is nowhere narrower than the narrower of both: what hides the target from all
  /// of the cell has an edge longer than half of that, along some axis.
  static double least_cover(const FlatCell& cell, const Target& target) {
    const auto edge = [&](std::size_t i) { return math::length(cell.corners[i + 1] - cell.corners[i]); };
    return target.is_infinite ? 0 : 0.25 * std::min({edge(0), edge(1), 2 * target.radius});
  }

  /// From every corner, and so from all points between, the triangle hides the whole target: what a segment's end is to
  /// all corners maps them to a convex set in the triangle's plane.
  bool covers(const geometry::TriangleVertices& triangle) const {
    const Vec3 extent = math::max(triangle.v0, math::max(triangle.v1, triangle.v2)) -
                        math::min(triangle.v0, math::min(triangle.v1, triangle.v2));
    if (math::max_component(extent) < least_cover_) return false;
    const Vec3 normal = geometry::normal_of(triangle);
    const Vec3 vertex[3]{triangle.v0, triangle.v1, triangle.v2};
    const double size = std::max({reach_, math::max_component(abs(triangle.v0)), math::max_component(abs(triangle.v1)),
                                  math::max_component(abs(triangle.v2))});
    const double error = gamma(256) * size;
    const double side = dot(normal, cell_.corners[0] - triangle.v0) < 0 ? -1 : 1;
    const Vec3 end = towards(target_, triangle.v0);
    if (!(-side * dot(normal, end) > target_.radius + error)) return false;
    return std::ranges::all_of(cell_.corners, [&](const Vec3& corner) {
      if (!(side * dot(normal, corner - triangle.v0) > error)) return false;
      const Vec3 to_target = towards(target_, corner);
      for (int i = 0; i < 3; ++i) {
        const Vec3 a = vertex[i] - corner, b = vertex[(i + 1) % 3] - corner;
        const Vec3 across = math::cross(a, b);
        const double length = math::length(across);
        // Seen from the side the normal points to, vertices run counter-clockwise.
        if (!(-side * dot(across, to_target) > length * target_.radius + error * size * size)) return false;
      }
      return true;
    });
  }

  /// Hidden from every corner is hidden from the whole cell: the points that see the target hidden by one convex body
  /// are a convex set.
  bool covers(const geometry::SphereShape& sphere) const {
    return std::ranges::all_of(cell_.corners, [&](const Vec3& corner) {
      return ViewCone::around(towards(target_, corner), target_.radius, target_.is_infinite)
          .is_covered_by(sphere.center - corner, sphere.radius);
    });
  }

  static constexpr std::size_t patience = 128;
  const World& world_;
  const FlatCell& cell_;
  const Target& target_;
  const SurfaceId& self_;
  CellContents& found_;
  double reach_, least_cover_;
  std::size_t met_ = 0;
  bool is_dark_ = false;
};

CellContents::CellContents(const World& world, const FlatCell& cell, const Target& target, const SurfaceId& self) {
  verdict_ = Search(world, cell, target, self, *this).run();
}

/// For `outlined`.
class CellContents::OutlineSearch {
 public:
  OutlineSearch(const World& world, const HalfSpaces& region, const RoundCell& viewpoints, const SurfaceId* self,
                CellContents& found)
      : world_(world), region_(region), viewpoints_(viewpoints), self_(self), found_(found) {
    if (self != nullptr) self_triangle_ = OwnedTriangles(world).index(*self);
  }

  void run() {
    found_.outline_.emplace();
    const auto at_triangle = [&](std::uint32_t triangle, const RegionVisitor::EdgeFlags& edges) {
      return add_triangle(triangle, edges);
    };
    const auto at_other = [&](std::uint32_t item) { return add_other(item); };
    const auto left_out = [&] { found_.outline_->has_triangles = true; };
    std::optional<Silhouettes> silhouettes;
    if (world_.structure.cones)
      silhouettes.emplace(Silhouettes{*world_.structure.cones, viewpoints_.center, viewpoints_.radius});
    const bool is_too_much =
        std::ranges::any_of(world_.infinite_items, at_other) ||
        search(world_.structure, region_, silhouettes ? &*silhouettes : nullptr, at_triangle, at_other, left_out);
    if (is_too_much) {
      found_ = {};
      return;
    }
    // In scene order, as they are wanted.
    std::ranges::sort(found_.others_);
    std::ranges::sort(pending_);
    found_.outline_->edges = EdgeList(viewpoints_.center, viewpoints_.radius);
    found_.outline_->edges.reserve(pending_.size());
    const OwnedTriangles owned(world_);
    for (const std::uint64_t edge : pending_)
      found_.outline_->edges.add(owned, static_cast<std::uint32_t>(edge >> 2), static_cast<std::uint32_t>(edge & 3));
  }

 private:
  bool add_other(std::uint32_t id) {
    const Item& item = world_.items[id];
    if (item.kind == Kind::plane && self_ != nullptr && id == self_->item) return false;
    if (misses(region_, world_, item)) return false;
    if (item.kind == Kind::sphere && item.placement == no_placement && item.is_opaque) {
      found_.outline_->spheres.add(world_.spheres[item.index], id);
      return found_.outline_->spheres.size() > sphere_capacity;
    }
    if (found_.others_.size() == other_capacity) return true;
    found_.others_.push_back(id);
    return false;
  }

  bool add_triangle(std::uint32_t triangle, const RegionVisitor::EdgeFlags& edges) {
    const bool is_self = triangle == self_triangle_;
    if (!OwnedTriangles(world_).is_opaque(triangle)) {
      if (is_self || region_.miss(world_.triangles[triangle])) return false;
      if (found_.triangle_count_ == triangle_capacity) return true;
      found_.triangles_[found_.triangle_count_++] = triangle;
      return false;
    }
    if (!is_self) {
      found_.outline_->has_triangles = true;
      if (!edges.is_within_limits) {
        const geometry::TriangleVertices vertices = world_.triangles[triangle];
        if (!region_.is_within_limits(vertices) && !region_.miss(vertices)) return true;
      }
    }
    for (std::uint32_t e = 0; e < 3; ++e) {
      // The first of two neighbours speaks for their edge.
      if (world_.triangles.neighbours[triangle][e] < triangle || !edges[e]) continue;
      if (pending_.size() == edge_capacity) return true;
      pending_.push_back(std::uint64_t{triangle} << 2 | e);
    }
    return false;
  }

  static constexpr std::size_t edge_capacity = 1024, sphere_capacity = 2048;
  const World& world_;
  const HalfSpaces& region_;
  const RoundCell& viewpoints_;
  const SurfaceId* self_;
  std::uint32_t self_triangle_ = OwnedTriangles::none;
  CellContents& found_;
  std::vector<std::uint64_t> pending_;  // 4·triangle + edge
};

CellContents CellContents::outlined(const World& world, const FlatCell& cell, const Target& target,
                                    const SurfaceId& self) {
  CellContents result;
  const std::optional<HalfSpaces> region = hull(cell, target);
  if (region) OutlineSearch(world, *region, around(cell), &self, result).run();
  return result;
}

CellContents CellContents::outlined(const World& world, const RoundCell& cell, const Target& target) {
  CellContents result;
  const std::optional<HalfSpaces> region = hull(cell, target);
  if (region) OutlineSearch(world, *region, cell, nullptr, result).run();
  return result;
}

bool cross_transparent(const World& world, const CellContents& contents, const geometry::Ray& ray, double limit,
                       accel::Crossed& crossed) {
  const geometry::PreparedRay prepared(ray.origin, ray.direction);
  const OwnedTriangles owned(world);
  for (const std::uint32_t triangle : contents.triangles()) {
    if (!crosses(world.triangles[triangle], prepared, limit)) continue;
    const std::uint32_t item = owned.item(triangle);
    if (world.items[item].is_opaque) return false;
    crossed.add(item);
  }
  return std::ranges::none_of(contents.others(), [&](std::uint32_t item) {
    return cross_item(world, item, prepared, ray.self, limit, crossed);
  });
}

}  // namespace penumbra::shading::shadows
