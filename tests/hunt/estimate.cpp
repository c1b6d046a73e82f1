// How the oracle averages, and how sure it is.
#include <algorithm>
#include <cmath>

#include "tests/hunt/oracle.h"

namespace penumbra::hunt {
namespace {

/// Of V, a half-plane's edge across a disc, jittered samples: variance ≈ this · share · (1 − share) · n^−1.5.
constexpr double spread_variance = 0.62;

Color root(const Color& a) { return {std::sqrt(a.r), std::sqrt(a.g), std::sqrt(a.b)}; }

template <class Function>
Color channels(const Function& function) {
  return {function(&Color::r), function(&Color::g), function(&Color::b)};
}

}  // namespace

Estimate Oracle::pixel(int column, int row, int side, int repeats, bool thorough, Random& random) const {
  if (is_integrated()) return integrated(column, row, side * side * repeats, random);
  const Gathered gathered = gather(column + 0.5, row + 0.5, 0, 0);
  Estimate sum{gathered.constant, {}, {}, math::max_channel(gathered.constant)};
  for (const Term& term : gathered.terms) add_term(term, side, repeats, thorough, random, sum);
  sum.sigma = root(sum.sigma);
  return sum;
}

/// Adds variances to `sum.sigma`.
void Oracle::add_term(const Term& term, int side, int repeats, bool thorough, Random& random, Estimate& sum) const {
  const double count = static_cast<double>(side) * side;
  Color total, squares, of_samples, open_total;
  int done = 0;
  while (done < repeats) {
    Color mean, first;
    bool all_agree = true;
    for (int i = 0; i < side; ++i) {
      for (int k = 0; k < side; ++k) {
        Color open;
        const Color value = sample(term, (i + random.uniform()) / side, (k + random.uniform()) / side, open);
        if (i == 0 && k == 0) first = value;
        all_agree = all_agree && value == first;
        mean += value * (1 / count), open_total += open * (1 / count), of_samples += value * value * (1 / count);
      }
    }
    total += mean, squares += mean * mean, ++done;
    if (done == 1 && all_agree && !thorough) break;
  }
  const double n = count * done;
  const Color mean = total * (1.0 / done), stake = open_total * (1.0 / done);
  const auto square = [](double x) { return x * x; };
  const Color spread =
      channels([&](double Color::*c) { return std::max(0.0, of_samples.*c / done - square(mean.*c)); });
  sum.mean += mean;
  sum.spread += spread;
  sum.stake += math::max_channel(stake);
  sum.sigma += channels([&](double Color::*c) {
    const double between = done > 1 ? std::max(0.0, squares.*c / done - square(mean.*c)) / (done - 1) : 0;
    // Neither a few repeats that happen to agree nor samples that all do prove that nothing varies.
    const double expected = spread_variance * spread.*c / (count * std::sqrt(count) * done);
    return std::max({between, 0.5 * expected, square(0.5 * stake.*c / n)});
  });
}

Estimate Oracle::integrated(int column, int row, int count, Random& random) const {
  Color total, squares;
  double stake = 0;
  for (int i = 0; i < count; ++i) {
    const bool is_square = options_.samples_per_pixel > 1;
    const double x = is_square ? random.uniform() : 0.5, y = is_square ? random.uniform() : 0.5;
    const double r = std::sqrt(random.uniform()), angle = 6.283185307179586 * random.uniform();
    const Gathered gathered = gather(column + x, row + y, r * std::cos(angle), r * std::sin(angle));
    Color value = gathered.constant;
    double open_sum = math::max_channel(gathered.constant);
    for (const Term& term : gathered.terms) {
      Color open;
      const double u = random.uniform(), v = random.uniform();
      value += sample(term, u, v, open);
      open_sum += math::max_channel(open);
    }
    total += value, squares += value * value;
    stake = std::max(stake, open_sum);
  }
  const double n = count;
  Estimate result{total * (1 / n), {}, {}, stake};
  result.spread =
      channels([&](double Color::*c) { return std::max(0.0, squares.*c / n - result.mean.*c * result.mean.*c); });
  result.sigma =
      root(channels([&](double Color::*c) { return std::max(result.spread.*c / n, 0.25 * stake * stake / (n * n)); }));
  return result;
}

/// Rays all around the pixel's center: whatever edge runs through it lies between two of them.
bool Oracle::is_ambiguous(int column, int row) const {
  if (is_integrated()) return false;
  const auto eight_units_on = [&](double x) {
    const Ray ray = camera_ray(x, row + 0.5, 0, 0);
    return ray.origin + ray.direction * 8;
  };
  const double away = 2 * touch_ / math::length(eight_units_on(column + 1) - eight_units_on(column));
  const Gathered middle = gather(column + 0.5, row + 0.5, 0, 0);
  if (middle.is_on_edge) return true;
  const auto all = [](const Gathered& g) {
    Color sum = g.constant;
    for (const Term& term : g.terms) sum += term.weight;
    return sum;
  };
  const Color value = all(middle);
  const double allowed = 1e-4 * math::max_channel(value) + 1e-12;
  for (int i = 0; i < 6; ++i) {
    const double angle = 1 + i * 1.0471975512;
    const Gathered other = gather(column + 0.5 + away * std::cos(angle), row + 0.5 + away * std::sin(angle), 0, 0);
    if (other.is_on_edge || other.signature != middle.signature || other.trail.size() != middle.trail.size())
      return true;
    for (std::size_t k = 0; k < other.trail.size(); ++k) {
      if (std::fabs(other.trail[k] - middle.trail[k]) > 1e-3 * middle.trail[k] + 1e-4) return true;
    }
    const Color apart = all(other) - value;
    if (std::max({std::fabs(apart.r), std::fabs(apart.g), std::fabs(apart.b)}) > allowed) return true;
  }
  return false;
}

}  // namespace penumbra::hunt
