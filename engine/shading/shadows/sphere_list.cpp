#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/shading/shadows/sphere_list.cpp"
#include "engine/accel/simd-inl.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "engine/math/constants.h"
#include "engine/shading/shadows/sphere_list.h"

HWY_BEFORE_NAMESPACE();
namespace penumbra::shading::shadows::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using simd::HWY_NAMESPACE::bits;

using Doubles = hn::CappedTag<double, SphereList::width>;

// Products and sums one by one, in the order of math::dot: the same bits on every processor.
template <class V>
HWY_INLINE V ordered_dot(const Vec3& a, V x, V y, V z) {
  const Doubles d;
  return hn::Add(hn::Add(hn::Mul(hn::Set(d, a.x), x), hn::Mul(hn::Set(d, a.y), y)), hn::Mul(hn::Set(d, a.z), z));
}

/// False if a sphere covers the cone. Line by line what place_in and SeenSphere do.
bool append_block(const SphereList::Block& block, const Projection& projection, std::uint32_t self,
                  std::vector<SeenSphere>& seen) {
  const Doubles d;
  const ViewCone& cone = projection.cone;
  const auto less = hn::Set(d, 1 - ViewCone::margin), more = hn::Set(d, 1 + ViewCone::margin);
  for (std::size_t lane = 0; lane < SphereList::width; lane += hn::Lanes(d)) {
    unsigned found = block.is_there >> lane & ((1u << hn::Lanes(d)) - 1);
    const auto x = hn::Sub(hn::Load(d, block.center[0] + lane), hn::Set(d, projection.apex.x)),
               y = hn::Sub(hn::Load(d, block.center[1] + lane), hn::Set(d, projection.apex.y)),
               z = hn::Sub(hn::Load(d, block.center[2] + lane), hn::Set(d, projection.apex.z));
    const auto radius = hn::Load(d, block.radius + lane), r2 = hn::Mul(radius, radius);
    const auto squared = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
    const auto tangent = hn::Sqrt(hn::Sub(squared, r2));  // no number for an apex inside
    if (!projection.is_infinite) {
      const auto beyond = hn::Sub(ordered_dot(projection.w, x, y, z), hn::Set(d, 1.0));
      const auto reach = hn::Mul(r2, hn::Set(d, math::dot(projection.w, projection.w)));
      found &= ~bits(d, hn::And(hn::Gt(beyond, hn::Zero(d)), hn::Gt(hn::Mul(beyond, beyond), reach)));
    }
    unsigned covering = 0;
    if (cone.is_known()) {
      const auto is_outside = hn::Gt(squared, hn::Mul(r2, more));
      const auto along = ordered_dot(cone.axis(), x, y, z), distance = hn::Sqrt(squared);
      const auto tc = hn::Mul(tangent, hn::Set(d, cone.cosine())), rs = hn::Mul(radius, hn::Set(d, cone.sine()));
      const auto limit = hn::Sub(hn::Sub(tc, rs), hn::Mul(hn::Set(d, ViewCone::margin), distance));
      found &= ~bits(d, hn::And(is_outside, hn::Lt(along, limit)));
      const auto is_wide = hn::Gt(hn::Mul(radius, less), hn::Mul(hn::Set(d, cone.sine()), distance));
      const auto is_before = hn::And(hn::Gt(along, hn::Zero(d)), hn::Lt(squared, hn::Set(d, cone.before())));
      const auto is_around = hn::Gt(hn::Mul(along, less), hn::Add(tc, rs));
      covering = bits(d, hn::And(hn::And(is_wide, is_outside), hn::And(is_before, is_around)));
    }
    if (found == 0) continue;
    const auto size = hn::IfThenElse(hn::Gt(squared, r2), hn::Div(r2, squared), hn::Set(d, math::infinity));
    alignas(64) double rows[6][SphereList::width];
    hn::Store(x, d, rows[0]), hn::Store(y, d, rows[1]), hn::Store(z, d, rows[2]);
    hn::Store(radius, d, rows[3]), hn::Store(tangent, d, rows[4]), hn::Store(size, d, rows[5]);
    for (; found != 0; found &= found - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(found));
      const std::uint32_t item = block.item[lane + i];
      if (item == self) continue;
      if ((covering >> i & 1) != 0) return false;
      seen.emplace_back(Vec3{rows[0][i], rows[1][i], rows[2][i]}, rows[3][i], rows[4][i], rows[5][i], item);
    }
  }
  return true;
}

bool append_spheres(std::span<const SphereList::Block> blocks, const Projection& projection, std::uint32_t self,
                    std::vector<SeenSphere>& seen) {
  return std::ranges::all_of(
      blocks, [&](const SphereList::Block& block) HWY_ATTR { return append_block(block, projection, self, seen); });
}

/// Takes away what one of the first `count` spheres hides; they are no smaller.
void drop_spheres(std::vector<SeenSphere>& seen, std::size_t count) {
  const Doubles d;
  alignas(64) double x[SphereList::width]{}, y[SphereList::width]{}, z[SphereList::width]{},
      radius[SphereList::width]{}, tangent[SphereList::width];
  std::fill_n(tangent, SphereList::width, math::infinity);  // of lanes that hide nothing
  for (std::size_t i = 0; i < count; ++i) {
    x[i] = seen[i].center.x, y[i] = seen[i].center.y, z[i] = seen[i].center.z, radius[i] = seen[i].radius;
    tangent[i] = seen[i].tangent;
  }
  // The angle between the centers and the smaller's angular radius add up to no more than the larger's: by the cosine
  // of the difference of both radii.
  const auto is_hidden = [&](const SeenSphere& sphere) HWY_ATTR {
    unsigned hiding = 0;
    for (std::size_t lane = 0; lane < SphereList::width; lane += hn::Lanes(d)) {
      const auto dot = ordered_dot(sphere.center, hn::Load(d, x + lane), hn::Load(d, y + lane), hn::Load(d, z + lane));
      const auto least = hn::Add(hn::Mul(hn::Load(d, tangent + lane), hn::Set(d, sphere.tangent)),
                                 hn::Mul(hn::Load(d, radius + lane), hn::Set(d, sphere.radius)));
      hiding |= bits(d, hn::Gt(hn::Mul(dot, hn::Set(d, 1 - ViewCone::margin)), least));
    }
    return hiding != 0;
  };
  const auto rest = seen.begin() + static_cast<std::ptrdiff_t>(count);
  seen.erase(std::remove_if(rest, seen.end(), is_hidden), seen.end());
}

}  // namespace
}  // namespace penumbra::shading::shadows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace penumbra::shading::shadows {

HWY_EXPORT(append_spheres);
HWY_EXPORT(drop_spheres);

bool SphereList::append(const Projection& projection, std::uint32_t self, std::vector<SeenSphere>& seen) const {
  return HWY_DYNAMIC_DISPATCH(append_spheres)(blocks_, projection, self, seen);
}

void SphereList::add(const geometry::SphereShape& sphere, std::uint32_t item) {
  const std::size_t lane = size_++ % width;
  if (lane == 0) blocks_.push_back({});
  Block& block = blocks_.back();
  for (int axis = 0; axis < 3; ++axis) block.center[axis][lane] = sphere.center[axis];
  block.radius[lane] = sphere.radius, block.item[lane] = item;
  block.is_there = static_cast<std::uint8_t>(block.is_there | 1u << lane);
}

bool SphereList::contains(std::uint32_t item) const {
  return std::ranges::any_of(blocks_, [&](const Block& block) {
    return std::ranges::any_of(std::span(block.item).first(std::popcount(block.is_there)),
                               [&](std::uint32_t there) { return there == item; });
  });
}

SeenSphere::SeenSphere(const geometry::SphereShape& sphere, const Vec3& apex, std::uint32_t id)
    : center(sphere.center - apex), radius(sphere.radius), item(id) {
  const double squared = math::dot(center, center), r2 = radius * radius;
  tangent = std::sqrt(squared - r2);
  size = squared > r2 ? r2 / squared : math::infinity;
}

InCone place_in(const Projection& projection, const geometry::SphereShape& sphere) {
  const Vec3 center = sphere.center - projection.apex;
  if (projection.cone.misses(center, sphere.radius)) return InCone::apart;
  const double beyond = math::dot(projection.w, center) - 1;
  if (!projection.is_infinite && beyond > 0 &&
      beyond * beyond > sphere.radius * sphere.radius * math::dot(projection.w, projection.w))
    return InCone::apart;
  return projection.cone.is_covered_by(center, sphere.radius) ? InCone::covers_it : InCone::crosses;
}

void drop_hidden(std::vector<SeenSphere>& seen) {
  constexpr std::size_t count = 6;  // of the largest: more hide little more
  if (seen.size() <= count) return;
  // The largest to the front: few ever take another's place.
  std::size_t least = 0;
  const auto find_least = [&] {
    for (std::size_t i = 0; i < count; ++i) least = seen[i].size < seen[least].size ? i : least;
  };
  find_least();
  for (std::size_t i = count; i < seen.size(); ++i) {
    if (!(seen[i].size > seen[least].size)) continue;
    std::swap(seen[i], seen[least]);
    find_least();
  }
  HWY_DYNAMIC_DISPATCH(drop_spheres)(seen, count);
}

}  // namespace penumbra::shading::shadows
#endif
