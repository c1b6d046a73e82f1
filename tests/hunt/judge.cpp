#include "tests/hunt/judge.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace penumbra::hunt {
namespace {

constexpr int samples = 1024;                   // of Penumbra's soft lights
constexpr int some_seeds = 8, many_seeds = 32;  // pictures averaged on suspicion, and for a verdict
constexpr double first_sigmas = 5, second_sigmas = 6, last_sigmas = 6.5;  // of which each uses numbers of its own
constexpr double allowance = 2e-4;  // of all the light a pixel may get: less is no fault anybody sees

constexpr double nothing = 1e-7;  // what a light leaves of which the oracle's samples meet no part

constexpr double Color::*channel[3]{&Color::r, &Color::g, &Color::b};

}  // namespace

render::Picture Renderer::operator()(const Change& change) {
  scene::Options options = job_.options;
  if (change.shadow_samples > 0) options.shadow_samples = change.shadow_samples;
  if (change.acceleration) options.acceleration = *change.acceleration;
  if (change.target_error) options.target_error = change.target_error;
  options.threads = change.threads.value_or(1);
  options.seed += change.seed;
  render::Control control;
  auto picture = render::render(job_.scene, options, pool_, control, change.switches);
  if (!picture) throw std::runtime_error("nothing was rendered");
  return std::move(*picture);
}

Judge::Judge(const api::JobRequest& job, const Renderer::Change& change, std::uint64_t seed)
    : job_(job), renderer_(job_), change_(change), oracle_(job_.scene, job_.options), random_(seed, 1) {
  job_.options.target_error.reset();
  job_.options.samples_per_pixel = std::min(job_.options.samples_per_pixel, 8);
  change_.shadow_samples = oracle_.is_integrated() ? 64 : samples;
  seeds_ = oracle_.is_integrated() ? some_seeds : 1;
}

Judge::Seen Judge::render(int seeds, std::uint64_t first_seed) {
  Seen seen;
  for (int i = 0; i < seeds; ++i) {
    change_.seed = first_seed + static_cast<std::uint64_t>(i);
    const render::Picture picture = renderer_(change_);
    const auto& rgb = picture.film->rgb;
    seen.mean.resize(rgb.size()), seen.variance.resize(rgb.size());
    for (std::size_t k = 0; k < rgb.size(); ++k)
      seen.mean[k] += rgb[k], seen.variance[k] += static_cast<double>(rgb[k]) * rgb[k];
  }
  for (std::size_t k = 0; k < seen.mean.size(); ++k) {
    seen.mean[k] /= seeds;
    const double scatter = std::max(0.0, seen.variance[k] / seeds - seen.mean[k] * seen.mean[k]);
    seen.variance[k] = seeds > 1 ? scatter / (seeds - 1) : 0;
  }
  return seen;
}

/// By how many times what chance explains, in the worst channel: above 1 is too much.
double Judge::difference(const Seen& seen, std::size_t pixel, const Estimate& truth, int seeds, double sigmas) const {
  double worst = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double value = seen.mean[3 * pixel + c], spread = truth.spread.*channel[c];
    double variance = seen.variance[3 * pixel + c];
    // What well-spread samples leave, doubled; of camera rays no more is taken for granted than that they are random.
    // From many pictures the scatter tells.
    const double expected = oracle_.is_integrated() ? spread / (job_.options.samples_per_pixel * seeds)
                                                    : 2 * 0.62 * spread / (samples * std::sqrt(samples) * seeds);
    if (seeds < many_seeds || oracle_.is_integrated()) variance = std::max(variance, expected);
    const double sigma = truth.sigma.*channel[c];
    const double bound = sigmas * std::sqrt(variance + sigma * sigma) + allowance * truth.stake + nothing;
    worst = std::max(worst, std::fabs(value - truth.mean.*channel[c]) / bound);
  }
  return worst;
}

std::vector<Judge::Suspect> Judge::first_look(const Seen& seen, Report& report) {
  std::vector<Suspect> suspects, doubtful, varied;
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < seen.mean.size() / 3; ++i) {
    truth_.push_back(oracle_.pixel(column(i), row(i), 8, 6, false, random_));
    const Estimate& truth = truth_.back();
    if (math::max_channel(truth.spread) > 0)
      sigmas.push_back(math::max_channel(truth.sigma)), varied.push_back({i, random_.uniform()});
    double off = 0;
    for (std::size_t c = 0; c < 3; ++c) off = std::max(off, std::fabs(seen.mean[3 * i + c] - truth.mean.*channel[c]));
    const double ratio = difference(seen, i, truth, seeds_, first_sigmas);
    const double fine = off / (1e-3 * truth.stake + 1e-12);
    if (ratio > 1) suspects.push_back({i, ratio});
    if (ratio <= 1 && fine > 1 && math::max_channel(truth.spread) == 0) doubtful.push_back({i, fine});
  }
  ambiguous_.assign(truth_.size(), 0);
  const auto keep = [](std::vector<Suspect>& list, std::size_t count) {
    std::ranges::sort(list, [](const Suspect& a, const Suspect& b) { return a.excess > b.excess; });
    list.resize(std::min(count, list.size()));
  };
  std::vector<Suspect> result;
  keep(suspects, 400), keep(doubtful, 30), keep(varied, 2);
  const auto take = [&](const std::vector<Suspect>& list, std::size_t count) {
    for (std::size_t i = 0, taken = 0; i < list.size() && taken < count; ++i) {
      const std::size_t pixel = list[i].pixel;
      if (ambiguous_[pixel] || oracle_.is_ambiguous(column(pixel), row(pixel))) {
        ambiguous_[pixel] = 1;
        continue;
      }
      result.push_back(list[i]), ++taken;
    }
  };
  take(suspects, 6), take(doubtful, 3), take(varied, 2);
  report.pixels += static_cast<long>(truth_.size());
  report.ambiguous += std::ranges::count(ambiguous_, 1);
  if (!sigmas.empty())
    std::ranges::nth_element(sigmas, sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 2));
  report.sigma = sigmas.empty() ? 0 : sigmas[sigmas.size() / 2];
  return result;
}

bool Judge::survives(std::size_t pixel, const Seen& first, Report& report) {
  Estimate truth = oracle_.pixel(column(pixel), row(pixel), 24, 8, true, random_);
  if (difference(first, pixel, truth, seeds_, second_sigmas) <= 1) return false;
  if (!some_) some_ = render(some_seeds, 1000);
  if (difference(*some_, pixel, truth, some_seeds, 4) <= 1) return false;
  if (!many_) many_ = render(many_seeds, 2000);
  truth = oracle_.pixel(column(pixel), row(pixel), 48, 16, true, random_);
  if (difference(*many_, pixel, truth, many_seeds, last_sigmas) <= 1) return false;
  char text[300];
  const double* got = &many_->mean[3 * pixel];
  std::snprintf(text, sizeof text,
                "pixel (%d, %d): (%.6g, %.6g, %.6g) instead of (%.6g, %.6g, %.6g) +- (%.1g, %.1g, %.1g)", column(pixel),
                row(pixel), got[0], got[1], got[2], truth.mean.r, truth.mean.g, truth.mean.b, truth.sigma.r,
                truth.sigma.g, truth.sigma.b);
  report.findings.push_back({"pixel", text, column(pixel), row(pixel)});
  return true;
}

/// What is too small to see in one pixel may show in all that vary, together.
void Judge::bias(const Seen& first, Report& report) {
  const auto total = [&](const Seen& seen, const std::vector<Estimate>& truth, int seeds, double& bound) {
    double sum = 0, variance = 0, stake = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (math::max_channel(truth_[i].spread) == 0 || ambiguous_[i]) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        const double spread = truth[i].spread.*channel[c], sigma = truth[i].sigma.*channel[c];
        sum += seen.mean[3 * i + c] - truth[i].mean.*channel[c];
        variance +=
            3 * (sigma * sigma + seen.variance[3 * i + c] + 2 * 0.62 * spread / (samples * std::sqrt(samples) * seeds));
      }
      stake += 3 * truth[i].stake;
    }
    bound = 6.5 * std::sqrt(variance) + allowance * stake + nothing;
    return sum;
  };
  if (oracle_.is_integrated()) return;
  double bound = 0;
  if (std::fabs(total(first, truth_, seeds_, bound)) <= bound) return;
  if (!some_) some_ = render(some_seeds, 1000);
  std::vector<Estimate> fresh;
  for (std::size_t i = 0; i < truth_.size(); ++i) {
    const bool counts = math::max_channel(truth_[i].spread) > 0 && !ambiguous_[i];
    if (counts && oracle_.is_ambiguous(column(i), row(i))) ambiguous_[i] = 1;
    fresh.push_back(counts ? oracle_.pixel(column(i), row(i), 12, 8, true, random_) : truth_[i]);
  }
  const double sum = total(*some_, fresh, some_seeds, bound);
  if (std::fabs(sum) <= bound) return;
  char text[200];
  std::snprintf(text, sizeof text, "all pixels that vary, together: %.4g too much, where %.4g may be chance", sum,
                bound);
  report.findings.push_back({"bias", text});
}

void Judge::run(Report& report) {
  const Seen first = render(seeds_, 0);
  const std::vector<Suspect> suspects = first_look(first, report);
  for (const Suspect& suspect : suspects) {
    if (survives(suspect.pixel, first, report)) return;
  }
  bias(first, report);
}

}  // namespace penumbra::hunt
