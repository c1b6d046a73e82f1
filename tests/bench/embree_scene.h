#pragma once
#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "tests/bench/flat_scene.h"

namespace penumbra::bench {

/// How Embree is asked to work.
struct EmbreeSettings {
  int build_threads = 1;
  bool is_robust = false;
};

enum class FlatKind : std::uint8_t { triangle, sphere, cylinder };

/// What Embree's (geomID, primID) stands for: a place in one of the FlatScene's lists.
struct FlatId {
  FlatKind kind;
  std::uint32_t index;
};

/// The transparent crossings of one ray. Embree shows a filter the same crossing more than once: with spatial splits,
/// and in packets of eight and sixteen.
struct Passed {
  struct Crossing {
    const void* part;
    unsigned primitive;
    float t;
    bool operator==(const Crossing&) const = default;
  };
  std::size_t count = 0;
  std::array<Crossing, 64> crossings;

  bool is_new(const Crossing& crossing) {
    const auto end = crossings.begin() + static_cast<std::ptrdiff_t>(count);
    if (std::find(crossings.begin(), end, crossing) != end) return false;
    crossings.at(count++) = crossing;
    return true;
  }
};

/// Given to occlusion queries: what the transparent surfaces on the way let through, per channel and ray of the packet
/// (RTCRay::id).
struct ShadowContext {
  RTCIntersectContext context;  // first: Embree passes its address on
  float transmittance[3][16];
  std::array<Passed, 16> passed;

  void clear() {
    std::fill(&transmittance[0][0], &transmittance[0][0] + 3 * 16, 1.0f);
    for (Passed& each : passed) each.count = 0;
  }
};

/// Puts the committed scene `mesh` into `scene` as its geometry `id`.
void attach_instance(RTCDevice device, RTCScene scene, RTCScene mesh, const math::Affine& to_world, unsigned id);

/// A committed Embree scene with Embree's own best type for each shape, build quality high. Closest-hit queries see
/// every surface, occlusion queries multiply the transparent ones into their ShadowContext and go on.
class EmbreeScene {
 public:
  /// `materials` may be empty: all is opaque. `flat` and `materials` outlive this.
  EmbreeScene(const FlatScene& flat, const std::vector<scene::Material>& materials, const EmbreeSettings& settings);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  RTCScene scene() const { return scene_; }
  bool is_opaque() const { return is_opaque_; }
  FlatId flat_id(unsigned geometry, unsigned primitive) const;
  /// What Embree's instID stands for; the hit's primID is a triangle of its mesh.
  const FlatInstance& instance(unsigned id) const { return flat_.instances[id - part_count]; }
  /// Within this of where they start rays meet nothing that counts: some rounding of the largest coordinate.
  double nudge() const { return nudge_; }
  /// Seconds to fill the buffers and commit; the device is started before.
  double build_seconds() const { return build_seconds_; }

 private:
  /// Of one kind, opaque or transparent: places in the FlatScene's list.
  struct Part {
    const EmbreeScene* scene = nullptr;
    FlatKind kind{};
    bool is_transparent = false;
    std::vector<std::uint32_t> members;
  };
  static constexpr unsigned part_count = 6;

  template <class Shapes>
  void sort(const Shapes& shapes, FlatKind kind);
  RTCGeometry new_triangles(const FlatTriangle* triangles, const std::vector<std::uint32_t>& members);
  void add_triangles(const Part& part, unsigned id);
  void add_instances();
  void add_spheres(const Part& part, unsigned id);
  void add_cylinders(const Part& part, unsigned id);
  void attach(RTCGeometry geometry, const Part& part, unsigned id);
  static void let_through(const RTCFilterFunctionNArguments* arguments);
  std::uint32_t material_of(const FlatId& id) const;

  const FlatScene& flat_;
  const std::vector<scene::Material>& materials_;
  RTCDevice device_;
  RTCScene scene_;
  RTCSceneFlags flags_;
  std::vector<RTCScene> meshes_;
  std::array<Part, part_count> parts_;  // the index is Embree's geomID; instances follow
  bool is_opaque_ = true;
  double nudge_ = 0, build_seconds_ = 0;
};

/// Embree asks for denormals to be flushed while it works; restores the mode at the end.
class FlushedDenormals {
 public:
  FlushedDenormals();
  ~FlushedDenormals();
  FlushedDenormals(const FlushedDenormals&) = delete;
  FlushedDenormals& operator=(const FlushedDenormals&) = delete;

 private:
  unsigned saved_;
};

}  // namespace penumbra::bench
