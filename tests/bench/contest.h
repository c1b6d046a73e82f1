#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/render/film.h"

namespace penumbra::bench {

/// Of a film against the reference: the contract's RMSE in linear light clamped to [0, 1]; p99 and most are of a
/// pixel's worst channel; `bias` is how far the worst channel's mean over the picture is off; `trimmed` is the RMSE
/// without the worst pixel of each ten thousand or part of it.
struct Error {
  double rmse = 0, p99 = 0, most = 0, bias = 0, trimmed = 0;
};
Error error_of(const render::Film& film, const render::Film& reference);

/// A picture, the seconds of rendering alone, and the shadow rays, where they are counted.
struct Rendered {
  render::Film film;
  double seconds = 0;
  std::uint64_t shadow_rays = 0;
};

/// A renderer at one budget, and what was measured of it.
struct Budget {
  int samples;
  std::vector<double> seconds, rmse, p99, most;
  std::uint64_t shadow_rays = 0;
};

struct Contestant {
  std::string name;
  std::string family;  // of those that give the same image for the same samples
  /// Renders with this many samples and this seed.
  std::function<Rendered(int, std::uint64_t)> render;
  std::vector<int> samples;  // ascending: what it may be asked for
  std::size_t least_budgets = 5;
  std::vector<Budget> budgets = {};
  render::Film best = {};  // of the last budget
  bool is_done = false;    // needs no larger budget
  bool is_cut = false;     // or would take too long, or is slower than its family
};

struct ContestSettings {
  int runs = 5;
  double target = 1e-3;    // RMSE; who gets below it needs no larger budget
  double patience_s = 30;  // who takes longer for a picture goes no further
};

/// The first round finds how many budgets each contestant needs; the others repeat it, all in turn, with new seeds.
/// `each_round` is called once a round.
void compete(std::vector<Contestant>& contestants, const render::Film& reference, const ContestSettings& settings,
             const std::function<void()>& each_round);

/// Whether a contestant's finest picture tends to the reference, but for the few pixels whose camera rays slip through
/// an edge: Embree's do, unless it is robust.
struct Agreement {
  Error error;
  double allowed_bias;
  bool is_reached;  // the target, if there was the time
  bool holds() const { return is_reached && error.bias <= allowed_bias; }
};
Agreement agreement_of(const Contestant& contestant, const render::Film& reference, const ContestSettings& settings);

}  // namespace penumbra::bench
