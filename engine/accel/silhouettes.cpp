// Compiled once per instruction set; the best one the processor has is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/accel/silhouettes.cpp"
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

#include <bit>

#include "engine/accel/silhouettes.h"
#include "engine/accel/wide_walk.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::accel::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

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

HWY_INLINE unsigned bits(hn::Mask<Doubles> mask) {
  std::uint8_t bytes[8]{};
  hn::StoreMaskBits(Doubles(), mask, bytes);
  return bytes[0];
}

/// Which lanes' triangles wind counter-clockwise as the apex sees them, their normals' sense aside.
HWY_INLINE unsigned winding(const EdgeList::Block& block, std::size_t which, std::size_t lane, const Vec3& apex) {
  const Doubles d;
  const Vectors way = offset(block.origin[which], lane, apex);
  const auto& normal = block.normal[which];
  const V x = hn::Mul(hn::Load(d, normal[0] + lane), way.x), y = hn::Mul(hn::Load(d, normal[1] + lane), way.y),
          z = hn::Mul(hn::Load(d, normal[2] + lane), way.z);
  return bits(hn::Gt(hn::Add(hn::Add(x, y), z), hn::Zero(d)));
}

/// Which lanes' surfaces are this one.
HWY_INLINE unsigned equal(const SurfaceId* surfaces, const SurfaceId& surface) {
  const hn::RebindToUnsigned<Doubles> d;
  static_assert(sizeof(SurfaceId) == sizeof(std::uint64_t));
  const auto equal = hn::Eq(hn::LoadU(d, reinterpret_cast<const std::uint64_t*>(surfaces)),
                            hn::Set(d, std::bit_cast<std::uint64_t>(surface)));
  return bits(hn::RebindMask(Doubles(), equal));
}

void append_block(const EdgeList::Block& block, const Projection& projection, const SurfaceId& self,
                  std::vector<SilhouetteEdge>& silhouette) {
  const Doubles d;
  for (std::size_t lane = 0; lane < EdgeList::width; lane += hn::Lanes(d)) {
    const unsigned all = (1u << hn::Lanes(d)) - 1, here = block.has_edge >> lane & all;
    const unsigned turned = projection.is_mirrored ? all : 0;
    const unsigned left = winding(block, 0, lane, projection.apex) ^ turned,
                   right = winding(block, 1, lane, projection.apex) ^ turned;
    const unsigned has_own = all & ~equal(block.triangle[0] + lane, self),
                   has_other = block.has_other >> lane & ~equal(block.triangle[1] + lane, self) & all;
    unsigned found = here & (((has_own & has_other) & (left ^ right)) | (has_own ^ has_other));
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
    found &= ~bits(outside);
    if (found == 0) continue;
    alignas(64) double rows[6][EdgeList::width];
    hn::Store(ax, d, rows[0]), hn::Store(ay, d, rows[1]), hn::Store(az, d, rows[2]);
    hn::Store(bx, d, rows[3]), hn::Store(by, d, rows[4]), hn::Store(bz, d, rows[5]);
    for (; found != 0; found &= found - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(found));
      const auto is_in = [&](unsigned mask) { return (mask >> i & 1) != 0; };
      silhouette.push_back({{rows[0][i], rows[1][i], rows[2][i]},
                            {rows[3][i], rows[4][i], rows[5][i]},
                            jump_at(is_in(has_own), is_in(left), is_in(has_other), is_in(right)),
                            {block.triangle[0][lane + i], block.edge[lane + i]}});
    }
  }
}

void append_blocks(const EdgeList::Block* blocks, std::size_t count, const Projection& projection,
                   const SurfaceId& self, std::vector<SilhouetteEdge>& silhouette) {
  for (std::size_t i = 0; i < count; ++i) append_block(blocks[i], projection, self, silhouette);
}

}  // namespace penumbra::accel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace penumbra::accel {

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

void EdgeList::append(const Projection& projection, const SurfaceId& self,
                      std::vector<SilhouetteEdge>& silhouette) const {
  HWY_DYNAMIC_DISPATCH(append_blocks)(blocks_.data(), blocks_.size(), projection, self, silhouette);
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
  const Facing facing[2]{Facing(set[triangle]), Facing(set[has_other ? across : triangle])};
  for (int axis = 0; axis < 3; ++axis) {
    block.from[axis][lane] = from[axis], block.to[axis][lane] = to[axis];
    for (std::size_t which = 0; which < 2; ++which) {
      block.origin[which][axis][lane] = facing[which].origin[axis];
      block.normal[which][axis][lane] = facing[which].normal[axis];
    }
  }
  block.triangle[0][lane] = triangles.surface(triangle);
  block.triangle[1][lane] = has_other ? triangles.surface(across) : block.triangle[0][lane];
  block.edge[lane] = edge;
  block.has_edge = static_cast<std::uint8_t>(block.has_edge | 1u << lane);
  if (has_other) block.has_other = static_cast<std::uint8_t>(block.has_other | 1u << lane);
}

}  // namespace penumbra::accel
#endif
