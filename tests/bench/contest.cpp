#include "tests/bench/contest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

namespace penumbra::bench {
namespace {

void measure(const Contestant& contestant, Budget& budget, std::uint64_t seed, const render::Film& reference,
             render::Film& film) {
  Rendered rendered = contestant.render(budget.samples, seed);
  film = std::move(rendered.film);
  const Error error = error_of(film, reference);
  budget.seconds.push_back(rendered.seconds), budget.rmse.push_back(error.rmse);
  budget.p99.push_back(error.p99), budget.most.push_back(error.most);
  budget.shadow_rays = rendered.shadow_rays;
}

/// Where packets are full: from so many samples on, whoever is slower than its family stays so.
constexpr int full_packets = 64;

/// Ends those that took longer than `allowed` times the quickest of their family for the samples just measured.
void drop_slow(std::vector<Contestant>& contestants, std::size_t budget) {
  constexpr double allowed = 1.25;
  std::map<std::string, double> least;
  const auto has_it = [&](const Contestant& c) { return c.budgets.size() == budget + 1; };
  for (const Contestant& c : contestants) {
    if (!has_it(c)) continue;
    const double seconds = c.budgets.back().seconds.front();
    least[c.family] = least.contains(c.family) ? std::min(least[c.family], seconds) : seconds;
  }
  for (Contestant& c : contestants) {
    if (!has_it(c) || c.budgets.back().samples < full_packets ||
        c.budgets.back().seconds.front() <= allowed * least[c.family]) {
      continue;
    }
    c.budgets.pop_back();
    c.is_done = c.is_cut = true;
  }
}

}  // namespace

Error error_of(const render::Film& film, const render::Film& reference) {
  const std::size_t count = film.rgb.size() / 3;
  std::vector<double> worst(count), squares(count);
  std::array<double, 3> sums{};
  for (std::size_t i = 0; i < film.rgb.size(); ++i) {
    const double difference =
        static_cast<double>(std::clamp(film.rgb[i], 0.0f, 1.0f) - std::clamp(reference.rgb[i], 0.0f, 1.0f));
    squares[i / 3] += difference * difference, sums[i % 3] += difference;
    worst[i / 3] = std::max(worst[i / 3], std::fabs(difference));
  }
  std::sort(worst.begin(), worst.end());
  std::sort(squares.begin(), squares.end());
  const auto pixels = static_cast<double>(count);
  const auto kept = squares.end() - static_cast<std::ptrdiff_t>((count + 9999) / 10000);
  const double most_squares = std::accumulate(squares.begin(), kept, 0.0);
  const double squared = std::accumulate(kept, squares.end(), most_squares);
  const double bias = std::max({std::fabs(sums[0]), std::fabs(sums[1]), std::fabs(sums[2])}) / pixels;
  return {std::sqrt(squared / (3 * pixels)), worst[count * 99 / 100], worst.back(), bias,
          std::sqrt(most_squares / (3 * pixels))};
}

void compete(std::vector<Contestant>& contestants, const render::Film& reference, const ContestSettings& settings,
             const std::function<void()>& each_round) {
  each_round();
  const auto is_done = [](const Contestant& c) { return c.is_done; };
  for (std::size_t budget = 0; !std::ranges::all_of(contestants, is_done); ++budget) {
    for (Contestant& contestant : contestants) {
      if (contestant.is_done) continue;
      contestant.budgets.push_back({contestant.samples[budget], {}, {}, {}, {}});
      const Budget& last = contestant.budgets.back();
      measure(contestant, contestant.budgets.back(), 0, reference, contestant.best);
      const bool is_reached = last.rmse.front() < settings.target;
      const bool is_finest = contestant.budgets.size() == contestant.samples.size();
      const bool is_slow = last.seconds.front() > settings.patience_s;
      contestant.is_cut = !is_reached && !is_finest && is_slow;
      contestant.is_done =
          (is_reached && contestant.budgets.size() >= contestant.least_budgets) || is_finest || is_slow;
    }
    drop_slow(contestants, budget);
  }
  render::Film film;
  for (int run = 1; run < settings.runs; ++run) {
    each_round();
    for (Contestant& contestant : contestants) {
      for (Budget& budget : contestant.budgets)
        measure(contestant, budget, static_cast<std::uint64_t>(run), reference, film);
    }
  }
}

Agreement agreement_of(const Contestant& contestant, const render::Film& reference, const ContestSettings& settings) {
  // Noise averages out over the picture, but for what clamping makes of it.
  constexpr double least_bias = 3e-4, share_of_noise = 0.1;
  const Error error = error_of(contestant.best, reference);
  return {error, std::max(least_bias, share_of_noise * error.rmse),
          contestant.is_cut || error.trimmed < settings.target};
}

}  // namespace penumbra::bench
