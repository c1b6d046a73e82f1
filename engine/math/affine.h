#pragma once
#include "engine/math/vec3.h"

namespace penumbra::math {

/// x ↦ columns · x + translation. The default is the identity.
struct Affine {
  Vec3 column[3]{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Vec3 translation{};

  Vec3 vector(const Vec3& v) const { return column[0] * v.x + column[1] * v.y + column[2] * v.z; }
  Vec3 point(const Vec3& p) const { return vector(p) + translation; }
  /// Transposed linear part applied to `n`: world_to_local.transposed_vector maps local normals to world space.
  Vec3 transposed_vector(const Vec3& n) const { return {dot(column[0], n), dot(column[1], n), dot(column[2], n)}; }
  /// Determinant of the linear part; negative when the map mirrors.
  double determinant() const { return dot(column[0], cross(column[1], column[2])); }
  bool operator==(const Affine&) const = default;
};

/// a after b.
inline Affine operator*(const Affine& a, const Affine& b) {
  return {{a.vector(b.column[0]), a.vector(b.column[1]), a.vector(b.column[2])}, a.point(b.translation)};
}

/// The inverse map; `a` must have a determinant that is finite and not zero.
inline Affine inverse(const Affine& a) {
  const double scale = 1 / a.determinant();
  const Vec3 row0 = cross(a.column[1], a.column[2]) * scale;
  const Vec3 row1 = cross(a.column[2], a.column[0]) * scale;
  const Vec3 row2 = cross(a.column[0], a.column[1]) * scale;
  Affine result{{{row0.x, row1.x, row2.x}, {row0.y, row1.y, row2.y}, {row0.z, row1.z, row2.z}}, {}};
  result.translation = -result.vector(a.translation);
  return result;
}

}  // namespace penumbra::math
