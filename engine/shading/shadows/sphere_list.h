#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/geometry/quadrics.h"
#include "engine/shading/shadows/silhouettes.h"

namespace penumbra::shading::shadows {

/// An opaque sphere as an apex sees it.
struct SeenSphere {
  Vec3 center;  // relative to the apex
  double radius;
  double tangent;  // the length of the tangents; no number if the apex is in the sphere
  double size;     // the squared sine of its angular radius; endless if the apex is in the sphere
  std::uint32_t item;

  SeenSphere(const geometry::SphereShape& sphere, const Vec3& apex, std::uint32_t id);
  SeenSphere(const Vec3& c, double r, double t, double s, std::uint32_t id)
      : center(c), radius(r), tangent(t), size(s), item(id) {}
};

/// What a projection's cone is to a sphere.
enum class InCone : std::uint8_t { apart, crosses, covers_it };
InCone place_in(const Projection& projection, const geometry::SphereShape& sphere);
/// Takes away spheres that larger ones hide: every ray that meets one of them meets a larger one. Sorts.
void drop_hidden(std::vector<SeenSphere>& seen);

/// Opaque spheres in world space, for SIMD.
class SphereList {
 public:
  void add(const geometry::SphereShape& sphere, std::uint32_t item);
  std::size_t size() const { return size_; }
  bool contains(std::uint32_t item) const;

  /// Appends the spheres but `self` that are not apart from the projection's cone: to the last bit what `place_in` and
  /// SeenSphere tell of each. False, and nothing of use, if one covers the cone.
  bool append(const Projection& projection, std::uint32_t self, std::vector<SeenSphere>& seen) const;

  static constexpr std::size_t width = 8;
  struct Block {
    alignas(64) double center[3][width], radius[width];
    std::uint32_t item[width];
    std::uint8_t is_there = 0;  // a bit a lane
  };

 private:
  std::vector<Block> blocks_;
  std::size_t size_ = 0;
};

}  // namespace penumbra::shading::shadows
