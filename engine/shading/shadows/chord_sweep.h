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
  /// A line across a region of the disc, and what it stands for: so much of the region's width across the lines.
  struct Line {
    sampling::Point2 from, to;
    double width;
    bool is_second;  // of the halves that tell the error
  };
  /// A part of a line, in shares of its length, behind which so much gets through: not all of it black.
  struct OpenPart {
    std::size_t line;
    double begin, end;
    Color transmittance;
  };
  enum class Region { disc, square };                            // the largest square in the disc, along its axes
  static constexpr double half_square = 0.70710678118654752440;  // which reaches so far
  /// The same along as many lines across a region, for what is not the same all over it: finds them, and their open
  /// parts in ascending order.
  void trace(Region region, std::span<const DiscCover> covers, std::span<const SilhouetteEdge> silhouette,
             bool has_triangles, const sampling::DiscChords& chords, double turn, double shift, const Probe& probe);
  std::span<const Line> lines() const { return lines_; }
  std::span<const OpenPart> open_parts() const { return open_parts_; }
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
    double begin, end;  // of what is looked at
    int depth;          // triangles in line where the chord begins, but for a constant
    std::vector<Crossing> crossings;
    std::vector<Interval> opaque, clear;
  };
  struct Span {
    double begin, end;
  };
  /// A chord's points are offset·across + at·along.
  struct Frame {
    sampling::Point2 across, along;
    sampling::Point2 at(double offset, double place) const;
    Span across_square(double offset) const;
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

  void clip_to_disc(std::span<const SilhouetteEdge> silhouette);
  void clip_to_square(std::span<const SilhouetteEdge> silhouette);
  Frame choose_frame(std::span<const DiscCover> covers, double turn) const;
  void place_chords(const sampling::DiscChords& chords, double shift);
  /// Evenly across the largest square in the disc.
  void place_lines(const sampling::DiscChords& chords, const Frame& frame, double shift);
  void set_count(std::size_t count);
  struct Place {
    double offset, half_length, weight, begin, end;
  };
  void place(std::size_t index, const Place& at);
  /// Finds the edges in sight; true if there are none: then all sees the same, which behind_all tells.
  bool find_edges(Region region, std::span<const DiscCover> covers, std::span<const SilhouetteEdge> silhouette);
  Color behind_all(std::span<const DiscCover> covers, bool has_triangles, const Probe& probe) const;
  /// Finds what is hidden of the chords; false if all is.
  bool hide_all(std::span<const DiscCover> covers, bool has_triangles, const Frame& frame, const Probe& probe);
  std::size_t first_chord_from(double offset) const;
  bool begins_at(const sampling::Point2& rim, const Frame& frame) const;
  void add(const Edge& edge, const Frame& frame);
  void add(const DiscCover& cover, const Frame& frame);
  void hide(std::size_t chord, const Interval& interval);
  void hide_behind_triangles();
  /// Calls use(begin, end) for the parts of a chord that nothing opaque hides.
  template <class Use>
  void for_each_open(std::size_t index, const Use& use) const;
  /// Calls use(begin, end, transmittance) for their parts behind the same covers.
  template <class Use>
  void for_each_tinted(std::size_t index, const Use& use) const;

  Region region_ = Region::disc;
  std::vector<Edge> edges_;
  std::vector<Chord> chords_;               // by ascending offset
  std::size_t count_ = 0, open_count_ = 0;  // chords; those not hidden from end to end
  // By chord, filled up as ChordLanes are: beyond open_begin_ and open_end_ all is hidden.
  std::vector<double> offset_, open_begin_, open_end_, cover_begin_, cover_end_;
  std::vector<std::uint8_t> cover_hits_;
  std::vector<Line> lines_;
  std::vector<OpenPart> open_parts_;
  bool is_certain_ = false;
};

}  // namespace penumbra::shading::shadows
