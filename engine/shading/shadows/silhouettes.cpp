#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/shading/shadows/silhouettes.cpp"
#include "engine/accel/simd-inl.h"

#include <bit>

#include "engine/accel/wide_walk.h"
#include "engine/math/constants.h"
#include "engine/shading/shadows/silhouettes.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::shading::shadows::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using simd::HWY_NAMESPACE::bits;

using Doubles = hn::CappedTag<double, EdgeList::width>;
using V = hn::Vec<Doubles>;

struct Vectors {
  V x, y, z;
};

HWY_INLINE Vectors offset(const double (&rows)[3][EdgeList::width], std::size_t lane, const Vec3& from) {
  const Doubles d;
  return {hn::Sub(hn::Load(d, rows[0] + lane), hn::Set(d, from.x)),
          hn::Sub(hn::Load(d, rows[1] + lane), hn::Set(d, from.y)),
          hn::Sub(hn::Load(d, rows[2] + lane), hn::Set(d, from.z))};
}

// Products and sums one by one, in the order of math::dot: the same bits on every processor.
HWY_INLINE V dot(const Vec3& a, const Vectors& b) {
  const Doubles d;
  return hn::Add(hn::Add(hn::Mul(hn::Set(d, a.x), b.x), hn::Mul(hn::Set(d, a.y), b.y)), hn::Mul(hn::Set(d, a.z), b.z));
}

/// Lanes whose triangles are seen from the side their normal points to, and from the other.
struct Sides {
  unsigned front, back;
};

/// Line by line what TrianglePlane::side does; where every value is beyond `certain`, its sign is enough.
HWY_INLINE Sides sides(const EdgeList::Block& block, std::size_t which, std::size_t lane, const Projection& projection,
                       double certain) {
  const Doubles d;
  const auto load = [&](const double(&row)[EdgeList::width]) HWY_ATTR { return hn::Load(d, row + lane); };
  const Vectors to_origin = offset(block.origin[which], lane, projection.apex);
  const auto& normal = block.normal[which];
  const V x = hn::Mul(load(normal[0]), to_origin.x), y = hn::Mul(load(normal[1]), to_origin.y),
          z = hn::Mul(load(normal[2]), to_origin.z);
  const V value = hn::Neg(hn::Add(hn::Add(x, y), z));
  if (hn::AllTrue(d, hn::Gt(hn::Abs(value), hn::Set(d, certain)))) {
    const unsigned front = bits(d, hn::Gt(value, hn::Zero(d)));
    return {front, ~front};
  }
  const V distance = hn::Add(hn::Add(hn::Abs(to_origin.x), hn::Abs(to_origin.y)), hn::Abs(to_origin.z));
  const V off = hn::Add(hn::Mul(hn::Set(d, math::gamma(16)), hn::Add(load(block.size[which]), distance)),
                        hn::Set(d, projection.rounding));
  const V error = hn::Mul(hn::Mul(load(block.span[which]), hn::Add(load(block.span[which]), distance)), off);
  return {bits(d, hn::Gt(value, error)), bits(d, hn::Lt(value, hn::Neg(error)))};
}

/// Which lanes' surfaces are this one.
HWY_INLINE unsigned equal(const SurfaceId* surfaces, const SurfaceId& surface) {
  const hn::RebindToUnsigned<Doubles> d;
  static_assert(sizeof(SurfaceId) == sizeof(std::uint64_t));
  const auto equal = hn::Eq(hn::LoadU(d, reinterpret_cast<const std::uint64_t*>(surfaces)),
                            hn::Set(d, std::bit_cast<std::uint64_t>(surface)));
  return bits(Doubles(), hn::RebindMask(Doubles(), equal));
}

void append_block(const EdgeList::Block& block, const Projection& projection, double most_rounding,
                  const SurfaceId& self, std::vector<SilhouetteEdge>& silhouette) {
  const Doubles d;
  const double certain = projection.rounding <= most_rounding ? block.certain : math::infinity;
  for (std::size_t lane = 0; lane < EdgeList::width; lane += hn::Lanes(d)) {
    const unsigned all = (1u << hn::Lanes(d)) - 1, here = block.has_edge >> lane & all;
    const unsigned has_own = all & ~equal(block.triangle[0] + lane, self),
                   has_other = block.has_other >> lane & ~equal(block.triangle[1] + lane, self) & all;
    const Sides seen[2]{sides(block, 0, lane, projection, certain), sides(block, 1, lane, projection, certain)};
    const Sides own{seen[0].front & has_own, seen[0].back & has_own},
        other{seen[1].front & has_other, seen[1].back & has_other};
    unsigned found = here & ((own.front ^ other.front) | (own.back ^ other.back));
    if (found == 0) continue;
    const Vectors from = offset(block.from, lane, projection.apex), to = offset(block.to, lane, projection.apex);
    const V ax = dot(projection.x, from), ay = dot(projection.y, from), az = dot(projection.w, from),
            bx = dot(projection.x, to), by = dot(projection.y, to), bz = dot(projection.w, to);
    const auto both = [](V a, V a_limit, V b, V b_limit)
                          HWY_ATTR { return hn::And(hn::Gt(a, a_limit), hn::Gt(b, b_limit)); };
    auto outside = hn::Or(hn::Or(both(ax, az, bx, bz), both(hn::Neg(ax), az, hn::Neg(bx), bz)),
                          hn::Or(both(ay, az, by, bz), both(hn::Neg(ay), az, hn::Neg(by), bz)));
    const V one = hn::Set(d, 1.0);
    if (!projection.is_infinite) outside = hn::Or(outside, hn::Or(hn::Ge(az, one), hn::Ge(bz, one)));
    // As misses_disc.
    const auto size = [](V x, V y, V z) HWY_ATTR { return hn::Add(hn::Add(hn::Abs(x), hn::Abs(y)), hn::Abs(z)); };
    const auto minor = [](V a, V b, V c, V e) HWY_ATTR { return hn::Sub(hn::Mul(a, b), hn::Mul(c, e)); };
    const V nx = minor(ay, bz, az, by), ny = minor(az, bx, ax, bz), nz = minor(ax, by, ay, bx);
    const V distance =
        hn::Sub(hn::Abs(nz), hn::Mul(hn::Set(d, cross_error), hn::Mul(size(ax, ay, az), size(bx, by, bz))));
    const V reach = hn::Add(hn::Mul(nx, nx), hn::Mul(ny, ny));
    outside = hn::Or(outside, hn::And(hn::Gt(distance, hn::Zero(d)), hn::Gt(hn::Mul(distance, distance), reach)));
    found &= ~bits(d, outside);
    if (found == 0) continue;
    alignas(64) double rows[6][EdgeList::width];
    hn::Store(ax, d, rows[0]), hn::Store(ay, d, rows[1]), hn::Store(az, d, rows[2]);
    hn::Store(bx, d, rows[3]), hn::Store(by, d, rows[4]), hn::Store(bz, d, rows[5]);
    for (; found != 0; found &= found - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(found));
      const auto winding = [&](const Sides& side) {
        const int turn = static_cast<int>(side.front >> i & 1) - static_cast<int>(side.back >> i & 1);
        return projection.is_mirrored ? -turn : turn;
      };
      silhouette.push_back({{rows[0][i], rows[1][i], rows[2][i]},
                            {rows[3][i], rows[4][i], rows[5][i]},
                            jump_at(winding(own), winding(other)),
                            {block.triangle[0][lane + i], block.edge[lane + i]}});
    }
  }
}

void append_blocks(const EdgeList::Block* blocks, std::size_t count, const Projection& projection, double most_rounding,
                   const SurfaceId& self, std::vector<SilhouetteEdge>& silhouette) {
  for (std::size_t i = 0; i < count; ++i) append_block(blocks[i], projection, most_rounding, self, silhouette);
}

}  // namespace
}  // namespace penumbra::shading::shadows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace penumbra::shading::shadows {

HWY_EXPORT(append_blocks);

RimMeetings meet_rim(const Vec3& a, const Vec3& b) {
  const Vec3 d = b - a;
  const double q = d.x * d.x + d.y * d.y - d.z * d.z, half = a.x * d.x + a.y * d.y - a.z * d.z,
               c = a.x * a.x + a.y * a.y - a.z * a.z;
  const double discriminant = half * half - q * c;
  if (!(discriminant > 0)) return {0, 0, false};
  const double s = -(half + std::copysign(std::sqrt(discriminant), half));
  if (s == 0 || q == 0) return {-c / (2 * half), -c / (2 * half), half != 0};
  return {std::min(s / q, c / s), std::max(s / q, c / s), true};
}

bool is_in_disc(const Vec3& a, const Vec3& b) {
  const auto is_inside = [](const Vec3& p) { return p.z > 0 && p.x * p.x + p.y * p.y < p.z * p.z; };
  if (is_inside(a) || is_inside(b)) return true;
  if (a.z > 0 && b.z > 0) {
    // Both scaled to one z: the point of the segment nearest to the disc's middle.
    const double ax = a.x * b.z, ay = a.y * b.z, dx = b.x * a.z - ax, dy = b.y * a.z - ay, w = a.z * b.z;
    const double along = -(ax * dx + ay * dy), squared = dx * dx + dy * dy, across = ax * dy - ay * dx;
    return along > 0 && along < squared && across * across < squared * w * w;
  }
  const RimMeetings rim = meet_rim(a, b);
  return rim.exist && rim.first > 0 && rim.second < 1 && is_inside(a + (b - a) * (0.5 * (rim.first + rim.second)));
}

bool meets_cone(const std::array<Vec3, 3>& v) {
  // What is left of the triangle before the disc's plane and in front of the apex.
  std::array<Vec3, 5> corners;
  std::size_t count = 0;
  const auto is_kept = [](const Vec3& p) { return p.z >= 0 && p.z <= 1; };
  const auto keep = [&](const Vec3& p) { corners[count < corners.size() ? count++ : count - 1] = p; };
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &from = v[i], &to = v[(i + 1) % 3];
    if (is_kept(from)) keep(from);
    const auto cut = [&](double level) {
      if ((from.z < level) == (to.z < level) || from.z == level || to.z == level) return;
      const Vec3 p = from + (to - from) * ((level - from.z) / (to.z - from.z));
      keep({p.x, p.y, level});
    };
    cut(from.z < to.z ? 0 : 1), cut(from.z < to.z ? 1 : 0);
  }
  bool has_left = false, has_right = false;  // of the disc's middle
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 &a = corners[i], &b = corners[(i + 1) % count];
    if (is_in_disc(a, b)) return true;
    const double side = a.x * b.y - a.y * b.x;
    has_left = has_left || side > 0, has_right = has_right || side < 0;
  }
  return has_left != has_right;
}

void EdgeList::append(const Projection& projection, const SurfaceId& self,
                      std::vector<SilhouetteEdge>& silhouette) const {
  HWY_DYNAMIC_DISPATCH(append_blocks)(blocks_.data(), blocks_.size(), projection, most_rounding(), self, silhouette);
}

void EdgeList::add(const OwnedTriangles& triangles, std::uint32_t triangle, std::uint32_t edge) {
  const std::size_t lane = size_++ % width;
  if (lane == 0) blocks_.emplace_back();
  Block& block = blocks_.back();
  const TriangleSet& set = triangles.set();
  const std::uint32_t across = set.neighbours[triangle][edge];
  const bool has_other = across != TriangleSet::no_neighbour;
  const Vec3 &from = set.positions[set.corners[triangle][edge]],
             &to = set.positions[set.corners[triangle][(edge + 1) % 3]];
  const geometry::TrianglePlane plane[2]{geometry::TrianglePlane(set[triangle]),
                                         geometry::TrianglePlane(set[has_other ? across : triangle])};
  for (int axis = 0; axis < 3; ++axis) {
    block.from[axis][lane] = from[axis], block.to[axis][lane] = to[axis];
    for (std::size_t which = 0; which < 2; ++which) {
      block.origin[which][axis][lane] = plane[which].origin[axis];
      block.normal[which][axis][lane] = plane[which].normal[axis];
    }
  }
  for (std::size_t which = 0; which < 2; ++which) {
    block.size[which][lane] = plane[which].size, block.span[which][lane] = plane[which].span;
    const double reach = math::taxicab(plane[which].origin - middle_) + 2 * radius_;
    block.certain = std::max(block.certain, plane[which].error_at(reach, most_rounding()));
  }
  block.triangle[0][lane] = triangles.surface(triangle);
  block.triangle[1][lane] = has_other ? triangles.surface(across) : block.triangle[0][lane];
  block.edge[lane] = edge;
  block.has_edge = static_cast<std::uint8_t>(block.has_edge | 1u << lane);
  if (has_other) block.has_other = static_cast<std::uint8_t>(block.has_other | 1u << lane);
}

}  // namespace penumbra::shading::shadows
#endif
