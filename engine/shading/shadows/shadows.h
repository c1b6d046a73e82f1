#pragma once
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/accel/queries.h"
#include "engine/math/constants.h"
#include "engine/shading/batch_terms.h"
#include "engine/shading/counters.h"
#include "engine/shading/point_batch.h"
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
///   batch.cpp        points side by side; shared_samples: what all of them tell of each
///   shadow_rays.cpp  segments and bundles of them, where all of that does not tell
///   area_shadow.cpp  lines across area lights; or the same first steps, and rays
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

/// Discs that points side by side see of one light, in lanes.
struct SeenBatch {
  const PointBatch& points;
  LaneMask lanes;  // that look
  const DiscBatch& disc;
  const Lanes3& l;  // unit, the way the light travels
  Target target;    // as for Shadows::aim
  double radius;    // of the disc; 0: the light is a point
  std::size_t light;
  const sampling::Key* keys;  // by lane
  std::uint64_t samples;      // names those of this light

  sampling::Place place(std::size_t lane) const { return {keys[lane], samples}; }
};

/// An area light as a point sees it: points point + `axis` + x·`u` + y·`v` with |x|, |y| ≤ 1, or with x² + y² ≤ 1.
struct SeenArea {
  Vec3 axis, u, v;
  // Where the light is a sphere: that is seen through a disc, which its near side bulges out of.
  bool is_round = false;
  Vec3 center = {};
  double radius = 0;
  std::uint32_t ignored = accel::no_item;  // hides none of it
  /// Where on the way to a point of the disc or parallelogram the light is.
  double limit(const Vec3& towards) const;
};
/// A line across an area light, relative to the point: from + s·along with 0 ≤ s ≤ 1 stands for a strip of this width.
struct LightLine {
  Vec3 from, along;
  double width;
  bool is_second;  // of the halves that tell the error
};

/// Samples that points side by side take of an area light, as many each, in lanes.
struct SeenSamples {
  const PointBatch& points;
  LaneMask lanes, whole;         // that look; and those that have all of the light above the horizon
  std::span<const Lanes3> ways;  // to the samples, a round after the other
  const double* weights;         // of them in a point's mean, 1 on average, round by round and lane by lane
  bool may_lean;                 // see DiscSampling; then all samples together are one pattern
};

class Sight;

/// Holds what is found for one sight and used again by the next, and what neighbouring points share: one per thread.
class Shadows {
 public:
  /// All arguments outlive this object.
  Shadows(const Scene& scene, const Switches& switches, Counters& counters, const std::function<bool()>& is_canceled)
      : scene_(scene), switches_(switches), counters_(counters), is_canceled_(is_canceled), cells_(scene.world) {}

  /// What the point sees of the light that `light` names, which lies inside `target`; with `has_outline` outlines will
  /// be asked for. Good until the next call; the arguments outlive it.
  Sight aim(const ShadingPoint& at, std::size_t light, const Target& target, bool has_outline);
  /// The same of a light whose disc() will be asked for.
  Sight aim(const ShadingPoint& at, std::size_t light, const Target& target, const DiscSampling& of_disc);
  /// Finds what each point of a batch sees of its disc, with a place for each lane.
  void see(const SeenBatch& batch, const DiscSampling& sampling, Visibility* seen);
  /// The same of an area light; then `transmittance` is that of each sample.
  void see(const SeenSamples& samples, Visibility* seen);
  const Color& transmittance(std::size_t round, std::size_t lane) const {
    return transmittances_[round * lane_count + lane];
  }

 private:
  friend class Sight;
  /// Whether so few samples are asked for that rays to each, together with those of the points beside, cost less than
  /// to look for what may hide the light: the fewer, the larger triangles are beside pixels. The point and the scene
  /// decide, whatever structure there is.
  bool are_few(const ShadingPoint& at, const DiscSampling& sampling) const {
    if (!switches_.few_rays || !sampling.few) return false;
    const int count = sampling.spiral.count();
    return count <= 4 || scene_.has_many_quadrics || count * scene_.typical_edge <= 24 * at.footprint;
  }
  bool samples_alone(const ShadingPoint& at, const DiscSampling& sampling) const {
    return !switches_.shadow_candidates || are_few(at, sampling);
  }
  Color through_items(const std::vector<std::uint32_t>& items) const;
  void see_points(const SeenBatch& batch, Visibility* seen);
  void see_few(const SeenBatch& batch, const DiscSampling& sampling, Visibility* seen);
  /// Lets what some lanes see tell more of what each sees.
  void share(const PointBatch& points, LaneMask lanes, bool is_one_pattern, Visibility* seen);
  /// Adds a ray to the bundle, which is cast when it is full, and a place for what gets through.
  void add_ray(const ShadingPoint& at, const Vec3& direction, double limit, Color& transmittance);
  void cast_bundle(double limit);
  /// Few samples of points side by side.
  struct Few {
    const PointBatch& points;
    LaneMask lanes, whole;
    std::size_t count;  // of each point
    double limit;       // of the ways to them
    bool may_lean;
    const double* weights = nullptr;  // or all weigh the same
  };
  template <class WaysOf>
  void see_few(const Few& few, const WaysOf& ways_of, Visibility* seen);
  struct Rounds {
    std::size_t begin, end;  // in lanes: sixteen a round
  };
  /// Fills transmittances_ with what some lanes see in some rounds; false once it is canceled.
  template <class WaysOf>
  bool cast(const Few& few, LaneMask lanes, const Rounds& rounds, const WaysOf& ways_of);
  /// How many of the first samples see the light, or nothing of it.
  struct First {
    std::size_t end = 0, count = 0, lit = 0, dark = 0;
    bool agree() const { return count > 0 && (lit == count || dark == count); }
    bool nearly_agree() const { return count > 1 && (lit + 1 == count || dark + 1 == count); }
  };
  First told_by(LaneMask lanes, std::size_t end) const;
  /// What batches are off by that agree by chance, told by those in which a single first sample differs. Where a share
  /// s of a point's samples does, and it has n of the first, the one is n·s/(1 − s) times as likely as the other, which
  /// is off there by s: so each one accounts for s(1 − s)/n. Its point's other samples tell s; a single one tells
  /// nothing, and 1/6 is the mean of s(1 − s).
  void note_missed(LaneMask lanes, std::size_t count, const First& first, Visibility* seen) const;
  /// Weights of transmittances_, and what all of these tell: what those of a mean lack of their expected weight counts
  /// as much.
  struct Weights {
    const double* of;
    Color usual;
  };
  Weights weights_of(const Few& few, LaneMask lanes) const;
  /// Of `count` transmittances_, the first of them and every stride'th after it.
  Visibility mean_of(std::size_t first, std::size_t count, std::size_t stride, const Weights* weights = nullptr) const;
  const Scene& scene_;
  const Switches& switches_;
  Counters& counters_;
  const std::function<bool()>& is_canceled_;
  LightCells cells_;
  // Of the sight in use:
  accel::Crossed crossed_;
  accel::Bundle bundle_;
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
  /// What is known of an area light from outlines: where it is `listed`, parts of lines across it are open.
  enum class Verdict { lit, dark, listed, unknown };
  Verdict trace(const SeenArea& area, const DiscSampling& sampling, const sampling::Key& key);
  /// Lines across a light that is `lit`.
  void trace_open(const SeenArea& area, const DiscSampling& sampling, const sampling::Key& key);
  std::size_t line_count() const { return shadows_.sweep_.lines().size(); }
  LightLine line(const SeenArea& area, std::size_t index) const;
  std::span<const ChordSweep::OpenPart> open_parts() const { return shadows_.sweep_.open_parts(); }

  /// What is known of a light inside the quadrilateral `corners` (points, relative to the point). The item `ignored`
  /// hides none of the light.
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
  /// With more edges than these in sight, rays cost less than chords.
  std::size_t most_edges(const DiscSampling& sampling) const;
  /// Finds what may hide some of the disc; the item `ignored` does not.
  void gather(const DiscView& view, std::uint32_t ignored, bool is_above_horizon, std::size_t most_edges);
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
