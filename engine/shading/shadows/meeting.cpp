#include "engine/shading/shadows/meeting.h"

#include <array>
#include <cassert>
#include <cmath>
#include <span>

namespace penumbra::shading::shadows {
namespace {

using math::cross;
using math::dot;

/// The segments as a solid, relative to where they start; of endless ones as much as reaches beyond a ball.
struct Cone {
  Vec3 axis, u, v;

  Cone(const DiscView& view, double reach) : axis(view.axis), u(view.u), v(view.v) {
    if (!view.is_infinite) return;
    const double scale = 4 * reach / math::length(axis);
    axis = axis * scale, u = u * scale, v = v * scale;
  }
  /// Bounds every point's distance.
  double reach() const { return math::length(axis) + math::length(u) + math::length(v); }
  Vec3 farthest(const Vec3& way) const {
    const double x = dot(way, u), y = dot(way, v), size = std::sqrt(x * x + y * y);
    const Vec3 rim = size > 0 ? axis + u * (x / size) + v * (y / size) : axis;
    return dot(way, rim) > 0 ? rim : Vec3{};
  }
};

/// Along `way` of all points of a disc around 0 with this unit normal.
Vec3 on_rim(const Vec3& way, const Vec3& normal, double radius) {
  const Vec3 across = way - normal * dot(way, normal);
  const double size = math::length(across);
  return size > 0 ? across * (radius / size) : Vec3{};
}

/// The farthest point along `way` of an item in its own space; a tube ends `reach` away from `middle`.
struct Body {
  const accel::World& world;
  const accel::Item& item;
  Vec3 middle;
  double reach;

  Vec3 farthest(const Vec3& way) const {
    switch (item.kind) {
      case accel::Kind::sphere: {
        const geometry::SphereShape& sphere = world.spheres[item.index];
        const double size = math::length(way);
        return size > 0 ? sphere.center + way * (sphere.radius / size) : sphere.center;
      }
      case accel::Kind::tube: {
        const geometry::TubeShape& tube = world.tubes[item.index];
        const double at = dot(middle - tube.point, tube.axis) + std::copysign(reach, dot(way, tube.axis));
        return tube.point + tube.axis * at + on_rim(way, tube.axis, tube.radius);
      }
      case accel::Kind::cylinder: {
        const geometry::CylinderShape& cylinder = world.cylinders[item.index];
        const double at = dot(way, cylinder.axis) > 0 ? cylinder.height : 0;
        return cylinder.base + cylinder.axis * at + on_rim(way, cylinder.axis, cylinder.radius);
      }
      case accel::Kind::patch:
      case accel::Kind::mesh:
      case accel::Kind::plane:
        break;
    }
    assert(false);  // their covers are always simple
    return {};
  }
};

/// Up to four points; kept to those that are nearest to 0, with the way from them towards 0.
class Simplex {
 public:
  /// False once the points enclose 0.
  bool add(const Vec3& point) {
    for (std::size_t i = count_; i > 0; --i) points_[i] = points_[i - 1];
    points_[0] = point, ++count_;
    return count_ == 2 ? line() : count_ == 3 ? triangle() : count_ == 4 ? tetrahedron() : towards_point();
  }
  const Vec3& way() const { return way_; }

 private:
  bool keep(const Vec3& a, const Vec3& b, const Vec3& way) {
    points_[0] = a, points_[1] = b, count_ = 2, way_ = way;
    return way_.x != 0 || way_.y != 0 || way_.z != 0;
  }
  bool towards_point() {
    count_ = 1, way_ = -points_[0];
    return way_.x != 0 || way_.y != 0 || way_.z != 0;
  }
  bool line() {
    const Vec3 a = points_[0], ab = points_[1] - a;
    if (!(dot(ab, -a) > 0)) return towards_point();
    return keep(a, points_[1], cross(cross(ab, -a), ab));
  }
  bool triangle() {
    const Vec3 a = points_[0], b = points_[1], c = points_[2], ab = b - a, ac = c - a, n = cross(ab, ac);
    if (dot(cross(n, ac), -a) > 0) {
      if (dot(ac, -a) > 0) return keep(a, c, cross(cross(ac, -a), ac));
      return points_[1] = b, line();
    }
    if (dot(cross(ab, n), -a) > 0) return line();
    if (dot(n, -a) > 0) return way_ = n, true;
    if (dot(n, -a) < 0) return points_[1] = c, points_[2] = b, way_ = -n, true;
    return false;
  }
  bool tetrahedron() {
    const Vec3 a = points_[0], b = points_[1], c = points_[2], d = points_[3];
    const auto is_outside = [&](const Vec3& p, const Vec3& q) { return dot(cross(p - a, q - a), -a) > 0; };
    count_ = 3;
    if (is_outside(b, c)) return points_ = {a, b, c, d}, triangle();
    if (is_outside(c, d)) return points_ = {a, c, d, b}, triangle();
    if (is_outside(d, b)) return points_ = {a, d, b, c}, triangle();
    return false;
  }

  std::array<Vec3, 4> points_;
  std::size_t count_ = 0;
  Vec3 way_;
};

}  // namespace

bool meets_segments(const DiscView& view, const accel::World& world, const accel::Item& item) {
  static const math::Affine identity;
  const bool is_placed = item.placement != accel::no_placement;
  const math::Affine& out = is_placed ? world.placements[item.placement].local_to_world : identity;
  const math::Affine& in = is_placed ? world.placements[item.placement].world_to_local : identity;
  // What is looked at of endless segments reaches beyond the item, and of an endless tube beyond the segments.
  const auto box = accel::bounds_of(world, item);
  const double beyond = box ? math::length(box->center() - view.from) + math::length(box->extent()) : 0;
  if (view.is_infinite && !box) return true;
  const Cone cone(view, beyond);
  double stretch = 0;
  for (const Vec3& column : in.column) stretch += math::length(column);
  const Body body{world, item, in.point(view.from), 2 * stretch * cone.reach()};
  Vec3 way = cone.axis;
  Simplex simplex;
  for (int i = 0; i < 64; ++i) {
    const Vec3 local = out.transposed_vector(-way);
    const Vec3 point = cone.farthest(way) - (out.point(body.farthest(local)) - view.from);
    if (dot(point, way) < 0) return false;
    if (!simplex.add(point)) return true;
    way = simplex.way();
  }
  return true;
}

}  // namespace penumbra::shading::shadows
