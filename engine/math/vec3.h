#pragma once
#include <algorithm>
#include <cmath>

namespace penumbra::math {

/// A point, direction or normal in 3-space. No unit is implied; the function using it says whether it must be
/// normalised.
struct Vec3 {
  double x = 0, y = 0, z = 0;
  double operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  double& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  bool operator==(const Vec3&) const = default;
};

inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
inline Vec3 operator*(const Vec3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vec3 operator*(double s, const Vec3& a) { return a * s; }
inline Vec3& operator+=(Vec3& a, const Vec3& b) { return a = a + b; }
inline double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Vec3 abs(const Vec3& a) { return {std::fabs(a.x), std::fabs(a.y), std::fabs(a.z)}; }
inline Vec3 min(const Vec3& a, const Vec3& b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
inline Vec3 max(const Vec3& a, const Vec3& b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }
inline double taxicab(const Vec3& a) { return std::fabs(a.x) + std::fabs(a.y) + std::fabs(a.z); }
inline double max_component(const Vec3& a) { return std::max(a.x, std::max(a.y, a.z)); }
inline bool is_finite(const Vec3& a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }

/// Euclidean length, without overflow or underflow for any finite `a`.
inline double length(const Vec3& a) {
  const double squared = dot(a, a);
  if (squared > 1e-280 && squared < 1e280) return std::sqrt(squared);
  const double largest = max_component(abs(a));
  if (largest == 0 || !std::isfinite(largest)) return largest;
  const int exponent = std::ilogb(largest);
  const Vec3 scaled{std::scalbn(a.x, -exponent), std::scalbn(a.y, -exponent), std::scalbn(a.z, -exponent)};
  return std::scalbn(std::sqrt(dot(scaled, scaled)), exponent);
}

/// `a` at unit length; `a` must be finite and not zero.
inline Vec3 normalize(const Vec3& a) {
  const double squared = dot(a, a);
  if (squared > 1e-280 && squared < 1e280) return a * (1 / std::sqrt(squared));
  const int exponent = std::ilogb(max_component(abs(a)));
  const Vec3 scaled{std::scalbn(a.x, -exponent), std::scalbn(a.y, -exponent), std::scalbn(a.z, -exponent)};
  return scaled * (1 / std::sqrt(dot(scaled, scaled)));
}

/// `a` at unit length, or `otherwise` where it is zero: of a short vector far from the origin rounding may leave
/// nothing.
inline Vec3 normalize_or(const Vec3& a, const Vec3& otherwise) {
  return max_component(abs(a)) > 0 ? normalize(a) : otherwise;
}

/// Two unit vectors that complete the unit vector `n` to a right-handed orthonormal frame (u, v, n).
/// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
struct Frame {
  Vec3 u, v, n;
};
inline Frame frame_around(const Vec3& n) {
  const double sign = std::copysign(1.0, n.z);
  const double a = -1 / (sign + n.z);
  const double b = n.x * n.y * a;
  return {{1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

}  // namespace penumbra::math
