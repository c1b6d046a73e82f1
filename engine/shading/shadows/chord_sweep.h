#pragma once
#include <functional>
#include <span>
#include <vector>

#include "engine/math/color.h"
#include "engine/sampling/halves.h"
#include "engine/sampling/patterns.h"
#include "engine/shading/shadows/candidates.h"
#include "engine/shading/shadows/disc_cover.h"

namespace penumbra::shading::shadows {

/// Integrates the transmittance over a disc, exactly along each of a set of parallel chords. Holds scratch space: to be
/// used again and again, by one thread.
class ChordSweep {
 public:
  /// Whether the point (x, y) of the disc is seen past every opaque triangle.
  using Probe = std::function<bool(double x, double y)>;

  /// The mean transmittance behind `covers` and behind the triangles whose silhouette is `silhouette` (in homogeneous
  /// coordinates of the disc), from even and odd chords. `turn` ∈ [0, 1) turns the chords where no edge suggests a
  /// direction, `shift` ∈ [0, 1) displaces them. `probe` is asked once at most, if `has_triangles`.
  ///
  /// After Billen, Dutré, "Line Sampling for Direct Illumination", EGSR 2016, with chords that cross the edges in
  /// sight; and for triangles after Laine et al., "Soft Shadow Volumes for Ray Tracing", SIGGRAPH 2005: along a chord,
  /// edges tell how many triangles are in line, up to a constant; light comes at most from where they are fewest, and
  /// one ray tells whether it does.
  sampling::Halves integrate(std::span<const DiscCover> covers, std::span<const SilhouetteEdge> silhouette,
                             bool has_triangles, const sampling::DiscChords& chords, double turn, double shift,
                             const Probe& probe);
  /// Nothing last integrated has an edge in the disc: the mean is exact, though rounded.
  bool is_certain() const { return is_certain_; }

 private:
  /// Place on a chord, and how many more triangles are in line beyond it.
  struct Crossing {
    double at;
    int jump;
  };
  struct Interval {
    double begin, end;
    const DiscCover* cover;  // none: triangles
  };
  struct Chord {
    double half_length, weight;
    int depth;  // triangles in line where the chord begins, but for a constant
    std::vector<Crossing> crossings;
    std::vector<Interval> opaque, clear;
    Color lit;
  };
  /// A chord's points are offset·across + at·along.
  struct Frame {
    sampling::Point2 across, along;
    Linear turned(const Linear& f) const;
    Quadratic turned(const Quadratic& q) const;
  };
  /// The part of a silhouette edge in the disc; from.y < to.y once turned to the chords' frame.
  struct Edge {
    sampling::Point2 from, to;
    bool enters, leaves;  // through the disc's rim, at `from` and at `to`
    int jump;
    SilhouetteEdge::Place place;
  };
  struct OpenPlace {
    double x = 0, y = 0, length = 0;
  };

  void clip(std::span<const SilhouetteEdge> silhouette);
  Frame choose_frame(std::span<const DiscCover> covers, double turn) const;
  void place_chords(const sampling::DiscChords& chords, double shift);
  std::size_t first_chord_from(double offset) const;
  void add(const Edge& edge, const Frame& frame);
  void add(const DiscCover& cover, const Frame& frame);
  void hide(std::size_t chord, const Interval& interval);
  void hide_behind_triangles();
  /// Fills in what gets through a chord; offers the middle of its longest open part.
  void light(std::size_t index, const Frame& frame, OpenPlace& longest);

  std::vector<Edge> edges_;
  std::vector<Chord> chords_;               // by ascending offset
  std::size_t count_ = 0, open_count_ = 0;  // chords; those not hidden from end to end
  // By chord, filled up as ChordLanes are: beyond open_begin_ and open_end_ all is hidden.
  std::vector<double> offset_, open_begin_, open_end_, cover_begin_, cover_end_;
  std::vector<std::uint8_t> cover_hits_;
  bool is_certain_ = false;
};

}  // namespace penumbra::shading::shadows
