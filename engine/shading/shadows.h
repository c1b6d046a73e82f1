#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "engine/accel/candidates.h"
#include "engine/accel/queries.h"
#include "engine/sampling/patterns.h"
#include "engine/shading/chord_sweep.h"
#include "engine/shading/counters.h"
#include "engine/shading/disc_cover.h"
#include "engine/shading/light_cells.h"
#include "engine/shading/scene.h"
#include "engine/shading/shading_point.h"
#include "engine/shading/switches.h"

namespace penumbra::shading {

/// The variance of a mean, per channel, found in two ways. `measured` (see sampling::Halves) is right on average over
/// many means but may be small by chance; `modelled` is the typical variance of a mean like this: to stop at, no single
/// one should be trusted further.
struct Variance {
  Color measured, modelled;
};

/// The mean transmittance over a light and the variance of that estimate.
struct Visibility {
  Color mean = math::white;
  Variance variance;
  bool is_certain = false;  // exact: without variance
};

/// The error of a covered share s from N well-spread samples: its variance is about c·s(1 − s)·N^−1.5, with c measured
/// on half-planes across a disc.
inline constexpr double spread_variance = 0.62;
/// Likewise for chords: c·s(1 − s)·M^−3.
inline constexpr double chord_variance = 0.46;

/// The samples every disc light gets at a hit. Where its occluders are few and simple, chords that are as good as the
/// points of the spiral: √N of them. Two at least and an even number of
/// chords, so that halves tell the error.
struct DiscSampling {
  explicit DiscSampling(int samples)
      : spiral(std::max(2, samples)), chords(2 * std::max(1, static_cast<int>(std::ceil(0.5 * std::sqrt(samples))))) {}
  sampling::DiscSpiral spiral;
  sampling::DiscChords chords;
};

/// A disc light as a point sees it: around point + `axis`, with half-axes of length `radius` across the unit `normal`;
/// infinitely far away the disc is one of directions.
struct SeenDisc {
  Vec3 axis, normal;
  double radius;
  bool is_infinite = false;
};

/// Somebody who cancels waits for so many samples of one light at most.
inline constexpr std::uint32_t samples_between_looks = 64;

/// Answers how much of a light a point sees. Holds scratch space: one per thread.
class Shadows {
 public:
  /// All arguments outlive this object.
  Shadows(const Scene& scene, const Switches& switches, Counters& counters, const std::function<bool()>& is_canceled)
      : scene_(scene), switches_(switches), counters_(counters), is_canceled_(is_canceled), cells_(scene.world) {}

  /// To be called before any of the others: what is asked next is about this point and the light that `light` names,
  /// which lies inside `target`; `is_disc` where `disc` will be asked for.
  void aim(const ShadingPoint& at, std::size_t light, const accel::Target& target, bool is_disc);

  /// Product of the transmission of every surface on the segment from the point to point + `towards` (or, with `limit`
  /// infinite, on the ray). A segment to the far side of the point's own surface crosses that surface.
  Color transmittance(const ShadingPoint& at, const Vec3& towards, double limit);

  /// Mean transmittance over the disc.
  Visibility disc(const ShadingPoint& at, const SeenDisc& disc, const DiscSampling& sampling,
                  const sampling::Place& place);

  /// Prepares `transmittance_of_sample` for a light inside the quadrilateral `corners` (points, relative to the point).
  enum class Verdict { lit, dark, listed, unknown };
  /// The item `ignored` hides none of the light.
  Verdict classify(const ShadingPoint& at, const std::array<Vec3, 4>& corners, std::uint32_t ignored = accel::no_item);
  /// As `transmittance`, towards a place inside the quadrilateral last classified, which was not `dark`.
  Color transmittance_of_sample(Verdict verdict, const ShadingPoint& at, const Vec3& towards, double limit);

 private:
  using Shared = accel::CellContents::Verdict;
  Shared shared() const { return cell_ == nullptr ? Shared::unknown : cell_->verdict(); }
  /// What is listed for the cell, if something is.
  const accel::CellContents* listed() const { return shared() == Shared::listed ? cell_ : nullptr; }
  /// Fills crossed_ with the transparent items between the point and point + `towards`; false if one is opaque.
  bool cross(const ShadingPoint& at, const Vec3& towards, double limit);
  /// Fills transmittances_ with those towards the points of the spiral; with anything once it is canceled.
  void sample(const ShadingPoint& at, const Vec3& axis, const Vec3& u, const Vec3& v, double limit,
              const sampling::DiscSpiral& spiral, const sampling::DiscSpiral::Turn& turn);
  Color through_items(const std::vector<std::uint32_t>& items) const;
  Color own_surface(const ShadingPoint& at) const { return at.material->transmission; }
  /// Finds what may hide some of the disc.
  void gather(const ShadingPoint& at, const DiscView& view, bool is_above_horizon, std::size_t most_edges);
  /// Fills covers_ from the candidates: of the disc, some are listed to find the share of, one hides all, or one of
  /// them has no simple cover.
  enum class Covers { listed, dark, unknown };
  Covers find_covers(const ShadingPoint& at, const DiscView& view, bool has_horizon);

  const Scene& scene_;
  const Switches& switches_;
  Counters& counters_;
  const std::function<bool()>& is_canceled_;
  LightCells cells_;
  const accel::CellContents* cell_ = nullptr;  // of the point and light aimed at
  accel::Crossed crossed_;
  std::array<geometry::PreparedRay, accel::bundle_width> bundle_;
  std::array<accel::Crossed, accel::bundle_width> bundle_crossed_;
  std::vector<Color> transmittances_;
  accel::Candidates candidates_;
  std::vector<DiscCover> covers_;
  ChordSweep sweep_;
};

}  // namespace penumbra::shading
