#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/accel/silhouettes.h"
#include "engine/geometry/quadrics.h"

namespace penumbra::accel {

/// A sphere as an apex sees it.
struct SeenSphere {
  Vec3 centre;             // relative to the apex
  double radius, tangent;  // length of the tangents from the apex
  double size;             // the squared sine of its angular radius
  std::uint32_t item;
  bool is_opaque;
};

/// What a projection's cone is to a sphere.
enum class InCone : std::uint8_t { apart, crosses, covers_it };
InCone place_in(const Projection& projection, const geometry::SphereShape& sphere);
/// Appends a sphere that the apex is not in.
void see(const Projection& projection, const geometry::SphereShape& sphere, std::uint32_t item, bool is_opaque,
         std::vector<SeenSphere>& seen);
/// Takes away spheres that larger, opaque ones hide: every ray that meets one of them meets a larger one. Sorts.
void drop_hidden(std::vector<SeenSphere>& seen);

/// Spheres in world space, for SIMD.
class SphereList {
 public:
  void add(const geometry::SphereShape& sphere, std::uint32_t item, bool is_opaque);
  std::size_t size() const { return size_; }
  bool contains(std::uint32_t item) const;

  /// Appends the spheres but `self` that are not apart from the projection's cone and not around the apex: to the last
  /// bit what `place_in` and `see` tell of each. False, and nothing of use, if an opaque one covers the cone.
  bool append(const Projection& projection, std::uint32_t self, std::vector<SeenSphere>& seen) const;

  static constexpr std::size_t width = 8;
  struct Block {
    alignas(64) double centre[3][width], radius[width];
    std::uint32_t item[width];
    std::uint8_t is_there = 0, is_opaque = 0;  // a bit a lane
  };

 private:
  std::vector<Block> blocks_;
  std::size_t size_ = 0;
};

}  // namespace penumbra::accel
