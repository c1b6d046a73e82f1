#include "tests/hunt/error_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace penumbra::hunt {
namespace {

constexpr int smallest_picture = 600;    // pixels, for a statistic to mean something
constexpr double smallest_error = 3e-4;  // below, what one rare sample brings is as much as all others
constexpr int pictures = 16;
constexpr double Color::*channel[3]{&Color::r, &Color::g, &Color::b};

double clamped(double value) { return std::clamp(value, 0.0, 1.0); }

/// A mean over pixels, and how sure it is.
struct Mean {
  double sum = 0, squares = 0;
  long count = 0;
  void add(double value) { sum += value, squares += value * value, ++count; }
  double value() const { return sum / static_cast<double>(count); }
  double sigma() const { return std::sqrt(squares) / static_cast<double>(count); }
  /// Of how many values of one size it might be the mean.
  double values() const { return squares > 0 ? sum * sum / squares : 0; }
};

struct Errors {
  Mean by_pixel;        // squared, of pictures averaged
  Mean by_picture;      // squared
  double estimate = 0;  // squared
  double noise = 0;     // that the two truths leave, in squared
};

/// Two independent truths: the product of the differences from both is free of their noise.
using Truth = std::vector<Color>;

Errors errors(Renderer& renderer, Renderer::Change change, std::uint64_t first_seed, const Truth& a, const Truth& b) {
  Errors result;
  std::vector<double> squared(a.size());
  for (int i = 0; i < pictures; ++i) {
    change.seed = first_seed + static_cast<std::uint64_t>(i);
    const render::Picture picture = renderer(change);
    result.estimate += picture.stats.estimated_error * picture.stats.estimated_error / pictures;
    double sum = 0;
    for (std::size_t k = 0; k < 3 * a.size(); ++k) {
      const double v = clamped(picture.film->rgb[k]);
      const double product = (v - clamped(a[k / 3].*channel[k % 3])) * (v - clamped(b[k / 3].*channel[k % 3])) / 3;
      squared[k / 3] += product / pictures, sum += product;
    }
    result.by_picture.add(sum / static_cast<double>(a.size()));
  }
  for (const double value : squared) result.by_pixel.add(value);
  Mean apart;
  for (std::size_t k = 0; k < 3 * a.size(); ++k) {
    const double difference = clamped(a[k / 3].*channel[k % 3]) - clamped(b[k / 3].*channel[k % 3]);
    apart.add(difference * difference / 2);
  }
  result.noise = apart.sigma();
  return result;
}

std::string verdict(const Errors& found, std::optional<double> target, bool is_capped_late) {
  const double squared = found.by_picture.value();
  if (found.by_pixel.values() < 20 || squared < smallest_error * smallest_error) return {};
  // The pixels are what they are; by chance it is only how well a picture's samples lie.
  const double n = static_cast<double>(found.by_picture.count);
  const double margin = 6 * std::sqrt(std::max(0.0, found.by_picture.squares / n - squared * squared) / (n - 1)) +
                        0.05 * squared + 6 * found.noise;
  if (4 * found.estimate < squared - margin) return "estimate-low";
  if (found.estimate / 4 > squared + margin) return "estimate-high";
  // Where the caps stop it first, the target is not met.
  if (target && is_capped_late && squared - margin > 2.25 * *target * *target) return "estimate-target";
  return {};
}

}  // namespace

void check_samples(const api::JobRequest& job, Renderer& renderer, const Judge& judge, Report& report) {
  if (judge.oracle().is_integrated()) return;
  const auto grows = [&](int few, int more, std::uint64_t seed, Mean& before, Mean& after) {
    Renderer::Change change;
    change.seed = seed;
    change.shadow_samples = few;
    const render::Picture rough = renderer(change);
    change.shadow_samples = more;
    const render::Picture fine = renderer(change);
    Mean growth;
    for (std::size_t i = 0; i < judge.truth().size(); ++i) {
      const Estimate& truth = judge.truth()[i];
      if (judge.ambiguous()[i] || math::max_channel(truth.spread) == 0) continue;
      double a = 0, b = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double exact = truth.mean.*channel[c];
        a += std::pow(rough.film->rgb[3 * i + c] - exact, 2), b += std::pow(fine.film->rgb[3 * i + c] - exact, 2);
      }
      before.add(a), after.add(b), growth.add(b - a);
    }
    // A third more is no accident of the pattern.
    return growth.count > 30 && std::fabs(growth.values()) > 20 && growth.value() > 6 * growth.sigma() &&
           after.value() > 1.7 * before.value() && after.value() > 1e-7;
  };
  for (const auto& [few, more] : {std::pair{16, 64}, {64, 1024}}) {
    bool always = true;
    Mean before, after;
    for (std::uint64_t seed = 100; seed < 103 && always; ++seed)
      always = grows(few, more, seed, before = {}, after = {});
    if (!always) continue;
    char text[200];
    std::snprintf(text, sizeof text, "rmse %.3g with %d samples, %.3g with %d", std::sqrt(before.value() / 3), few,
                  std::sqrt(after.value() / 3), more);
    report.findings.push_back({"samples", text});
  }
  (void)job;
}

void check_estimate(const api::JobRequest& job, Renderer& renderer, std::uint64_t seed, Report& report) {
  const int width = job.options.width, height = job.options.height;
  if (width * height < smallest_picture) return;
  const Oracle oracle(job.scene, job.options);
  Random random(seed, 2);
  Truth a, b;
  for (int i = 0; i < width * height; ++i) {
    for (Truth* truth : {&a, &b}) truth->push_back(oracle.pixel(i % width, i / width, 16, 4, false, random).mean);
  }
  std::vector<std::optional<double>> targets{job.options.target_error};
  // Given nothing but caps that high, somebody wants a target.
  if (!job.options.target_error && job.options.samples_per_pixel >= 256) targets = {0.02, 0.002};
  const bool is_capped_late =
      (oracle.is_integrated() ? job.options.samples_per_pixel : job.options.shadow_samples) >= 1024;
  for (const std::optional<double>& target : targets) {
    Renderer::Change change;
    change.target_error = target;
    const std::string kind = verdict(errors(renderer, change, 0, a, b), target, is_capped_late);
    if (kind.empty()) continue;
    const Errors again = errors(renderer, change, 5000, a, b);
    if (verdict(again, target, is_capped_late) != kind) continue;
    char text[200];
    std::snprintf(text, sizeof text, "rmse %.4g, estimated %.4g%s%s", std::sqrt(again.by_picture.value()),
                  std::sqrt(again.estimate), target ? ", target " : "", target ? std::to_string(*target).c_str() : "");
    report.findings.push_back({kind, text});
  }
}

}  // namespace penumbra::hunt
