#include "engine/accel/normal_cones.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "engine/math/constants.h"

namespace penumbra::accel {
namespace {

constexpr double single_rounding = 0x1p-21;  // of single precision, a few times over

struct Cone {
  Vec3 axis;
  double angle = 0;  // radians; beyond a right angle the cone tells nothing
};
using PossibleCone = std::optional<Cone>;

/// Between unit vectors that far apart: 2·asin(chord/2) ≤ chord·(1 + chord²/8), an upper bound below two thirds of a
/// right angle, without a libm call.
double angle_of(double chord) { return chord * (1 + chord * chord / 8) + single_rounding; }

PossibleCone not_too_wide(const Cone& cone) {
  constexpr double widest = 1.0;  // radians: beyond, hardly any point sees all normals from one side
  return cone.angle < widest ? PossibleCone(cone) : std::nullopt;
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
    result.angle = std::max(result.angle, angle_of(math::length(result.axis - cone->axis)) + cone->angle);
  }
  return not_too_wide(result);
}

void put(const PossibleCone& cone, std::size_t lane, NormalCones::Cones& cones) {
  // The Taylor series of the cosine, cut where it is too small, bounds it from below.
  const double a = cone ? cone->angle * cone->angle : 0;
  const double cosine = cone ? 1 - a / 2 + a * a / 24 - a * a * a / 720 : math::nan;
  for (int axis = 0; axis < 3; ++axis) cones.axis[axis][lane] = cone ? static_cast<float>(cone->axis[axis]) : 0;
  cones.cosine[lane] = static_cast<float>(cosine - single_rounding);
  cones.sine[lane] = static_cast<float>(cone ? std::sqrt(1 - cosine * cosine) + single_rounding : 1);
}

/// Unit; no numbers for a sliver, whose normal is all rounding.
Vec3 normal_or_none(const geometry::TriangleVertices& t) {
  const Vec3 e = t.v1 - t.v0, f = t.v2 - t.v0, n = math::cross(e, f);
  const double square = math::dot(n, n);
  if (!(square > single_rounding * single_rounding * math::dot(e, e) * math::dot(f, f)))
    return {math::nan, math::nan, math::nan};
  return n * (1 / std::sqrt(square));
}

/// The normals of some triangles and of their neighbours.
class Normals {
 public:
  void add(const TriangleSet& triangles, std::uint32_t index, const std::vector<Vec3>& normals) {
    add(normals[index]);
    for (const std::uint32_t neighbour : triangles.neighbours[index]) {
      add(neighbour == TriangleSet::no_neighbour ? Vec3{math::nan, math::nan, math::nan} : normals[neighbour]);
    }
  }

  /// Around their mean; nothing where one is no number.
  PossibleCone cone() const {
    Vec3 sum;
    for (std::size_t i = 0; i < count_; ++i) sum += normals_[i];
    if (!(math::length(sum) > 0.1 * static_cast<double>(count_))) return std::nullopt;
    const Vec3 axis = math::normalize(sum);
    double square = 0;  // of the longest chord
    for (std::size_t i = 0; i < count_; ++i) {
      const Vec3 chord = normals_[i] - axis;
      square = std::max(square, math::dot(chord, chord));
    }
    return not_too_wide({axis, angle_of(std::sqrt(square)) + single_rounding});
  }

 private:
  void add(const Vec3& normal) { normals_[count_++] = normal; }
  std::array<Vec3, 4 * WideTree::width> normals_;
  std::size_t count_ = 0;
};

/// The vertex of `triangle` that is not on its edge with `neighbour`.
const Vec3& vertex_across(const TriangleSet& triangles, std::uint32_t triangle, std::uint32_t neighbour) {
  const auto& neighbours = triangles.neighbours[triangle];
  const auto edge = static_cast<std::size_t>(std::ranges::find(neighbours, neighbour) - neighbours.begin());
  return triangles.positions[triangles.corners[triangle][(edge + 2) % 3]];
}

}  // namespace

NormalCones::NormalCones(const WideTree& tree, const TriangleSet& triangles, const ParallelFor& parallel_for)
    : of_nodes_(tree.nodes().size()), beside_blocks_(tree.triangle_blocks().size()) {
  std::vector<Vec3> normals(triangles.size());
  in_chunks(normals.size(), parallel_for, [&](std::size_t, std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) normals[i] = normal_or_none(triangles[static_cast<std::uint32_t>(i)]);
  });
  std::vector<PossibleCone> whole_block(beside_blocks_.size()), whole_node(of_nodes_.size());
  const auto look_at_block = [&](std::size_t i) {
    const WideTree::TriangleBlock& block = tree.triangle_blocks()[i];
    std::ranges::fill(std::span(&beside_blocks_[i].vertex[0][0][0], 9 * WideTree::width), math::float_nan);
    Normals all;
    for (std::size_t lane = 0; lane < WideTree::width && !std::isnan(block.vertex[0][0][lane]); ++lane) {
      const std::uint32_t triangle = block.triangle[lane];
      all.add(triangles, triangle, normals);
      for (std::size_t e = 0; e < 3; ++e) {
        const std::uint32_t other = triangles.neighbours[triangle][e];
        if (other == TriangleSet::no_neighbour) continue;
        const Vec3 vertex = vertex_across(triangles, other, triangle) - tree.origin();
        for (int axis = 0; axis < 3; ++axis) beside_blocks_[i].vertex[e][axis][lane] = static_cast<float>(vertex[axis]);
      }
    }
    whole_block[i] = all.cone();
  };
  in_chunks(whole_block.size(), parallel_for, [&](std::size_t, std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) look_at_block(i);
  });
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
