#pragma once
#include <embree3/rtcore.h>

#include <cstdint>

#include "tests/bench/flat_scene.h"

namespace penumbra::bench {

/// How Embree is asked to work.
struct EmbreeSettings {
  int build_threads = 1;
  bool is_robust = false;
};

/// A committed Embree scene, build quality high, with Embree's own best type for each shape. Geometry ids tell the
/// kinds; primitive ids count in the order of the FlatScene's lists.
class EmbreeScene {
 public:
  static constexpr unsigned triangles_id = 0, spheres_id = 1, cylinders_id = 2;

  EmbreeScene(const FlatScene& flat, const EmbreeSettings& settings);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  RTCScene scene() const { return scene_; }
  /// Seconds to fill the buffers and commit; the device is started before.
  double build_seconds() const { return build_seconds_; }

 private:
  void add_triangles(const FlatScene& flat);
  void add_spheres(const FlatScene& flat);
  void add_cylinders(const FlatScene& flat);

  RTCDevice device_;
  RTCScene scene_;
  double build_seconds_ = 0;
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
