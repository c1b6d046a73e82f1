#include "engine/shading/lights/area_light.h"

#include <algorithm>
#include <cmath>

#include "engine/math/elementary.h"
#include "engine/shading/phong.h"

namespace penumbra::shading {
namespace {

/// a / b by channel; 0 where both are, as no sample tells of any light then.
Color ratio(const Color& a, const Color& b) {
  const auto quotient = [](double x, double y) { return y > 0 ? x / y : 0; };
  return {quotient(a.r, b.r), quotient(a.g, b.g), quotient(a.b, b.b)};
}

/// Of samples, with and without what hides them.
struct Sums {
  sampling::Halves seen, diffuse;  // of a (0, 2)-sequence: the first and the last samples; `diffuse` unshadowed
  Color squares_seen, squares_diffuse, products;
  Color diffuse_seen, diffuse_open, highlight_seen, highlight_open;

  void add(bool is_second, const AreaSample& sample) {
    const Color d = filtered(sample.diffuse, sample.transmittance);
    const Color h = filtered(sample.highlight, sample.transmittance);
    diffuse_seen += d, diffuse_open += sample.diffuse, highlight_seen += h, highlight_open += sample.highlight;
    seen.add(is_second, d + h), diffuse.add(is_second, sample.diffuse);
    squares_seen += (d + h) * (d + h), squares_diffuse += sample.diffuse * sample.diffuse;
    products += (d + h) * sample.diffuse;
  }
  /// The sum of (seen − share · diffuse)².
  Color squares(const Color& share) const {
    return squares_seen - share * products * 2 + share * share * squares_diffuse;
  }
};

}  // namespace

AreaSample lit_sample(const ShadingPoint& at, shadows::Sight& sight, shadows::Sight::Verdict verdict,
                      const Color& radiance, const Vec3& direction, const Vec3& place) {
  AreaSample sample{
      filtered(radiance, at.material->diffuse * std::fabs(math::dot(direction, at.surface.shading_normal))),
      filtered(radiance, highlight(at, -direction))};
  if (!math::is_black(sample.diffuse + sample.highlight))
    sample.transmittance = sight.transmittance_of_sample(verdict, place, 1);
  return sample;
}

Color diffuse_of(const ShadingPoint& at, const Color& radiance, double projected_solid_angle) {
  return filtered(radiance, at.material->diffuse * (projected_solid_angle / math::pi));
}

Color averaged(const Lighting& lighting, std::uint32_t camera_sample,
               const std::function<AreaSample(std::uint32_t)>& sample,
               const std::function<std::optional<Color>()>& exact_diffuse) {
  const auto count = static_cast<std::uint32_t>(lighting.sampling.spiral.count());
  Sums sums;
  for (std::uint32_t i = 0; i < count; ++i) {
    if ((i + 1) % samples_between_looks == 0 && lighting.is_canceled()) return math::black;
    sums.add(2 * i >= count, sample(camera_sample * count + i));
  }
  // With a closed form only the share that is seen is sampled: nearer to the truth, and exact where nothing or
  // everything is hidden. (Whether that is certain beforehand depends on how the scene is searched, which the picture
  // must not.) What varies then is the difference from that share.
  const double n = count;
  const std::optional<Color> exact = exact_diffuse();
  const Color share_seen = exact ? ratio(sums.diffuse_seen, sums.diffuse_open) : math::black;
  const sampling::Halves varying = sums.seen.minus(share_seen, sums.diffuse);
  const Color mean = exact ? *exact * share_seen + sums.highlight_seen * (1 / n) : sums.seen.mean();
  // That n samples agree does not mean that all would: as for discs, half a sample more may be shadowed or not. So it
  // may where a search of the scene would say for certain that it is not: not every search does.
  const double share = 0.5 / (n + 1);
  const Color at_stake = sums.highlight_open + (exact ? *exact * n : sums.diffuse_open);
  const Color unknown = at_stake * at_stake * (share * (1 - share) / (n * n));
  const Color found = sums.squares(share_seen) * (1 / n) - varying.mean() * varying.mean();
  const Color spread{std::max(found.r, unknown.r), std::max(found.g, unknown.g), std::max(found.b, unknown.b)};
  // As for discs: well-spread samples beat independent ones by √N in variance.
  const Color squared = filtered(lighting.weight, lighting.weight);
  const double scale = spread_variance / (n * std::sqrt(n));
  lighting.variance.measured += filtered(squared, varying.variance(sampling::Halves::points));
  lighting.variance.modelled += filtered(
      squared, {std::max(0.0, spread.r) * scale, std::max(0.0, spread.g) * scale, std::max(0.0, spread.b) * scale});
  return mean;
}

}  // namespace penumbra::shading
