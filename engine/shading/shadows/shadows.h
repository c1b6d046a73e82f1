#pragma once
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/accel/queries.h"
#include "engine/math/constants.h"
#include "engine/shading/counters.h"
#include "engine/shading/shading_point.h"
#include "engine/shading/shadows/candidates.h"
#include "engine/shading/shadows/chord_sweep.h"
#include "engine/shading/shadows/disc_cover.h"
#include "engine/shading/shadows/light_cells.h"
#include "engine/shading/switches.h"
#include "engine/shading/visibility.h"

/// How much of a light a point sees: the only door of this folder. Read it from here on:
///   shadows.cpp      the soft shadow of a disc, step by step; then those of a step, in this order:
///   light_cells      what neighbouring points share; cell: what may hide a light from a cell's points
///   candidates       what may hide it from one point; shaft, view_cone: the regions that tell
///   silhouettes      the edges at which the number of triangles in line changes; sphere_list: spheres, eight at a time
///   disc_cover       what simple shapes hide of the disc; chord_sweep, cover_chords: the share that is left
///   shadow_rays.cpp  segments and bundles of them, where all of that does not tell
///   area_shadow.cpp  the same first steps for area lights, whose samples are rays
namespace penumbra::shading::shadows {

/// A disc light as a point sees it: around point + `axis`, with half-axes of length `radius` across the unit `normal`;
/// infinitely far away the disc is one of directions.
struct SeenDisc {
  Vec3 axis, normal;
  double radius;
  bool is_infinite = false;
  /// Of segments to it, in units of the way to its points.
  double limit() const { return is_infinite ? math::infinity : 1; }
};

/// A disc to take samples of by rays, and nothing else, together with those that points beside see.
struct SampledDisc {
  const ShadingPoint* at;
  DiscView disc;  // from the point itself
  sampling::DiscSpiral::Turn turn;
  std::size_t place = 0;  // of the point among those beside
  Visibility seen = {};   // to be found
};

/// Of points beside, those that see all of the light for certain, or nothing of it; and a name that they share.
struct Votes {
  std::size_t lit = 0, dark = 0;
  std::uint64_t name = 0;
};

class Sight;

/// Holds what is found for one sight and used again by the next, and what neighbouring points share: one per thread.
class Shadows {
 public:
  /// All arguments outlive this object.
  Shadows(const Scene& scene, const Switches& switches, Counters& counters, const std::function<bool()>& is_canceled)
      : scene_(scene), switches_(switches), counters_(counters), is_canceled_(is_canceled), cells_(scene.world) {}

  /// What the point sees of the light that `light` names, which lies inside `target`; `of_disc` where its disc() will
  /// be asked for. Good until the next call; the arguments outlive it.
  Sight aim(const ShadingPoint& at, std::size_t light, const Target& target, const DiscSampling* of_disc = nullptr);
  /// Finds what is seen of each disc, all of them infinitely far or none.
  void sample(std::span<SampledDisc> discs, const DiscSampling& sampling, const Votes& votes = {});

 private:
  friend class Sight;
  /// Whether so few samples are asked for that rays to each, together with those of the points beside, cost less than
  /// to look for what may hide the light. The point and the scene decide, whatever structure there is.
  bool are_few(const ShadingPoint& at, const DiscSampling& sampling) const {
    return switches_.few_rays && sampling.spiral.count() <= (are_occluders_fine(at) ? 8 : 4);
  }
  /// Triangles as small as pixels, or many curved surfaces: what takes long to look for.
  bool are_occluders_fine(const ShadingPoint& at) const {
    return at.footprint > scene_.typical_edge || scene_.has_many_quadrics;
  }
  bool samples_alone(const ShadingPoint& at, const DiscSampling& sampling) const {
    return !switches_.shadow_candidates || are_few(at, sampling);
  }
  Color through_items(const std::vector<std::uint32_t>& items) const;
  /// Fills transmittances_ with those of some of each disc's samples; false once it is canceled.
  enum class Samples { first, others, all };
  bool cast(std::span<const SampledDisc> discs, const DiscSampling& sampling, Samples which);
  void cast_bundle(std::size_t size, double limit);
  /// What all first samples tell.
  enum class Agreement { none, lit, dark };
  Agreement agreement(std::span<const SampledDisc> discs, const DiscSampling& sampling, const Votes& votes) const;
  Visibility mean_of(std::size_t disc, std::size_t count) const;
  const Scene& scene_;
  const Switches& switches_;
  Counters& counters_;
  const std::function<bool()>& is_canceled_;
  LightCells cells_;
  // Of the sight in use:
  accel::Crossed crossed_;
  std::array<geometry::PreparedRay, accel::bundle_width> bundle_;
  std::array<accel::SurfaceId, accel::bundle_width> selves_;
  struct Sample {
    const ShadingPoint* at;
    Color* transmittance;
  };
  std::array<Sample, accel::bundle_width> of_;  // what the rays of the bundle are of
  std::array<accel::Crossed, accel::bundle_width> bundle_crossed_;
  std::vector<Color> transmittances_;
  Candidates candidates_;
  std::vector<DiscCover> covers_;
  ChordSweep sweep_;
};

/// Answers how much of a light a point sees.
class Sight {
 public:
  /// Product of the transmission of every surface on the segment from the point to point + `towards` (or, with `limit`
  /// infinite, on the ray). A segment to the far side of the point's own surface crosses that surface.
  Color transmittance(const Vec3& towards, double limit);

  /// Mean transmittance over the disc.
  Visibility disc(const SeenDisc& disc, const DiscSampling& sampling, const sampling::Place& place);
  /// Whether disc() would do no more than take samples by rays: then Shadows::sample may do so, for many points.
  bool is_sampled(const DiscSampling& sampling) const {
    return shadows_.samples_alone(at_, sampling) && shared() != Shared::lit && shared() != Shared::dark;
  }
  /// All of the light is seen for certain, or nothing of it.
  std::optional<bool> shared_verdict() const {
    return shared() == Shared::lit    ? std::optional(true)
           : shared() == Shared::dark ? std::optional(false)
                                      : std::nullopt;
  }
  SampledDisc sampled(const SeenDisc& disc, const sampling::Place& place) const;

  /// What is known of a light inside the quadrilateral `corners` (points, relative to the point). The item `ignored`
  /// hides none of the light.
  enum class Verdict { lit, dark, listed, unknown };
  Verdict classify(const std::array<Vec3, 4>& corners, std::uint32_t ignored = accel::no_item);
  /// As `transmittance`, towards a place inside the quadrilateral last classified, which was not `dark`.
  Color transmittance_of_sample(Verdict verdict, const Vec3& towards, double limit);

 private:
  friend class Shadows;
  Sight(Shadows& shadows, const ShadingPoint& at, const CellContents* cell)
      : shadows_(shadows), scene_(shadows.scene_), counters_(shadows.counters_), at_(at), cell_(cell) {}

  using Shared = CellContents::Verdict;
  Shared shared() const { return cell_ == nullptr ? Shared::unknown : cell_->verdict(); }
  /// What is listed for the cell, if something is.
  const CellContents* listed() const { return shared() == Shared::listed ? cell_ : nullptr; }
  /// Fills crossed_ with the transparent items between the point and point + `towards`; false if one is opaque.
  bool cross(const Vec3& towards, double limit);
  Color own_surface() const { return at_.material->transmission; }
  /// Every segment of a light sees the same: counts the rays that this saves.
  Visibility all(bool is_lit, const DiscSampling& sampling);
  /// Finds what may hide some of the disc.
  void gather(const DiscView& view, bool is_above_horizon, const DiscSampling& sampling);
  /// Fills covers_ from the candidates: of the disc, some are listed to find the share of, one hides all, or one of
  /// them has no simple cover.
  enum class Covers { listed, dark, unknown };
  Covers find_covers(const DiscView& view, bool has_horizon);
  Covers append_covers(const Candidate& candidate, const DiscView& view);
  Visibility sweep(const SeenDisc& disc, const DiscView& view, const DiscSampling& sampling, const sampling::Key& key);
  /// The disc seen from the point itself.
  DiscView view_of(const SeenDisc& disc) const;
  Visibility sample(const DiscView& disc, const DiscSampling& sampling, const sampling::Key& key);

  Shadows& shadows_;
  const Scene& scene_;
  Counters& counters_;
  const ShadingPoint& at_;
  const CellContents* cell_;  // of the point and light aimed at
};

/// Whether every way to the corners that lets light through leaves the point's surface on its outer side.
bool leaves_on_outer_side(const ShadingPoint& at, const std::array<Vec3, 4>& corners);

}  // namespace penumbra::shading::shadows
