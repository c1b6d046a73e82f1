#pragma once
#include <cstdint>
#include <optional>

namespace penumbra::scene {

/// none: every ray tests every object · cbr: a box per object · groups: the scene's own groups boxed ·
/// median: longest axis, median split, leaves ≤ 2 · bvh: binned surface area heuristic.
enum class Acceleration { none, cbr, groups, median, bvh };
/// srgb: IEC 61966-2-1 · linear: value × 255.
enum class Transfer { srgb, linear };
enum class ImageFormat { png, exr };

/// The values of `threads` that are not a count.
inline constexpr int serial = 0, all_threads = -1, cores_less_two = -2;

/// Section 3 of the contract.
struct Options {
  int width = 800, height = 800;  // pixels
  int samples_per_pixel = 1;
  int shadow_samples = 64;
  std::optional<double> target_error;
  std::optional<double> time_budget_s;
  int max_depth = 10;  // reflections and transmissions in a row; 0: camera rays only
  double min_contribution = 0.001;
  int threads = all_threads;
  Acceleration acceleration = Acceleration::bvh;
  std::uint64_t seed = 0;
  double exposure = 0;  // stops: the image and its errors are 2^exposure times what is seen; -100 to 100
  Transfer transfer = Transfer::srgb;
  ImageFormat format = ImageFormat::png;
  int bit_depth = 8;  // of PNG: 8 or 16
  double progress_interval_s = 0.5;
  int priority = 0;  // -100 to 100, higher first
};

}  // namespace penumbra::scene
