#include "engine/accel/normal_cones.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

namespace penumbra::accel {
namespace {

constexpr double rounding = 0x1p-21;  // of single precision, a few times over

struct Cone {
  Vec3 axis;
  double angle = 0;  // radians; beyond a right angle the cone tells nothing
};
using PossibleCone = std::optional<Cone>;

double angle_between(const Vec3& a, const Vec3& b) {
  // 2·asin(|a − b|/2) ≤ |a − b|·(1 + |a − b|²/8): an upper bound below two thirds of a right angle, without a libm
  // call.
  const double chord = math::length(a - b);
  return chord * (1 + chord * chord / 8) + rounding;
}

/// The cone around the mean of the axes.
PossibleCone around(std::span<const PossibleCone> cones) {
  Vec3 sum;
  for (const PossibleCone& cone : cones) {
    if (!cone) return std::nullopt;
    sum += cone->axis;
  }
  if (!(math::length(sum) > 0.1 * static_cast<double>(cones.size()))) return std::nullopt;
  Cone result{math::normalize(sum), 0};
  for (const PossibleCone& cone : cones) {
    result.angle = std::max(result.angle, angle_between(result.axis, cone->axis) + cone->angle);
  }
  constexpr double largest = 1.0;  // radians: beyond, hardly any point sees all normals from one side
  return result.angle < largest ? PossibleCone(result) : std::nullopt;
}

void put(const PossibleCone& cone, std::size_t lane, NormalCones::Cones& cones) {
  // The Taylor series of the cosine, cut where it is too small, bounds it from below.
  const double a = cone ? cone->angle * cone->angle : 0;
  const double cosine = cone ? 1 - a / 2 + a * a / 24 - a * a * a / 720 : std::numeric_limits<double>::quiet_NaN();
  for (int axis = 0; axis < 3; ++axis) cones.axis[axis][lane] = cone ? static_cast<float>(cone->axis[axis]) : 0;
  cones.cosine[lane] = static_cast<float>(cosine - rounding);
  cones.sine[lane] = static_cast<float>(cone ? std::sqrt(1 - cosine * cosine) + rounding : 1);
}

/// Of the triangle and its neighbours.
PossibleCone cone_of(const TriangleSet& triangles, std::uint32_t index, std::span<const PossibleCone> normals) {
  const auto& [a, b, c] = triangles.neighbours[index];
  constexpr std::uint32_t none = TriangleSet::no_neighbour;
  if (a == none || b == none || c == none) return std::nullopt;
  const PossibleCone around_it[]{normals[index], normals[a], normals[b], normals[c]};
  return around(around_it);
}

PossibleCone normal_cone(const geometry::TriangleVertices& t) {
  const Vec3 e = t.v1 - t.v0, f = t.v2 - t.v0, n = math::cross(e, f);
  // A sliver's normal is all rounding.
  if (!(math::length(n) > rounding * math::length(e) * math::length(f))) return std::nullopt;
  return Cone{math::normalize(n), rounding};
}

/// The vertex of `triangle` that is not on its edge with `neighbour`.
const Vec3& vertex_across(const TriangleSet& triangles, std::uint32_t triangle, std::uint32_t neighbour) {
  const auto& neighbours = triangles.neighbours[triangle];
  const auto edge = static_cast<std::size_t>(std::ranges::find(neighbours, neighbour) - neighbours.begin());
  return triangles.positions[triangles.corners[triangle][(edge + 2) % 3]];
}

}  // namespace

NormalCones::NormalCones(const WideTree& tree, const TriangleSet& triangles)
    : of_nodes_(tree.nodes().size()), beside_blocks_(tree.triangle_blocks().size()) {
  std::vector<PossibleCone> normals(triangles.size());
  for (std::uint32_t i = 0; i < triangles.size(); ++i) normals[i] = normal_cone(triangles[i]);
  std::vector<PossibleCone> whole_block(beside_blocks_.size()), whole_node(of_nodes_.size());
  for (std::size_t i = 0; i < beside_blocks_.size(); ++i) {
    const WideTree::TriangleBlock& block = tree.triangle_blocks()[i];
    std::ranges::fill(std::span(&beside_blocks_[i].vertex[0][0][0], 9 * WideTree::width), NAN);
    std::array<PossibleCone, WideTree::width> lanes;
    std::size_t count = 0;
    for (; count < WideTree::width && !std::isnan(block.vertex[0][0][count]); ++count) {
      lanes[count] = cone_of(triangles, block.triangle[count], normals);
      for (std::size_t e = 0; e < 3; ++e) {
        const std::uint32_t other = triangles.neighbours[block.triangle[count]][e];
        if (other == TriangleSet::no_neighbour) continue;
        const Vec3 vertex = vertex_across(triangles, other, block.triangle[count]) - tree.origin();
        for (int axis = 0; axis < 3; ++axis)
          beside_blocks_[i].vertex[e][axis][count] = static_cast<float>(vertex[axis]);
      }
    }
    whole_block[i] = around({lanes.data(), count});
  }
  // Children stand behind their parents.
  for (std::size_t i = of_nodes_.size(); i-- > 0;) {
    std::array<PossibleCone, WideTree::width> lanes;
    std::size_t count = 0;
    for (std::size_t lane = 0; lane < WideTree::width; ++lane) {
      const std::uint32_t child = tree.nodes()[i].child[lane];
      PossibleCone cone;
      if (WideTree::sort_of(child) == WideTree::Sort::node) cone = whole_node[WideTree::index_of(child)];
      if (WideTree::sort_of(child) == WideTree::Sort::triangle_block) cone = whole_block[WideTree::index_of(child)];
      put(cone, lane, of_nodes_[i]);
      if (child != WideTree::reference(WideTree::Sort::leaf, 0)) lanes[count++] = cone;
    }
    whole_node[i] = count > 0 ? around({lanes.data(), count}) : std::nullopt;
  }
}

}  // namespace penumbra::accel
