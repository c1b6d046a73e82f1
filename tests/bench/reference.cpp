#include "tests/bench/reference.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "tests/bench/area_rays.h"
#include "tests/bench/contract_image.h"
#include "tests/bench/embree_shadows.h"
#include "tests/bench/exact_hits.h"
#include "tests/bench/sample_patterns.h"
#include "tests/bench/workload.h"

namespace penumbra::bench {
namespace {

/// Point i of the two-dimensional Sobol' sequence, in units of 2^−32.
struct SobolPoint {
  std::uint32_t x = 0, y = 0;
  explicit SobolPoint(std::uint32_t i) {
    std::uint32_t direction = 1u << 31;
    for (std::uint32_t bit = 31; i; i >>= 1, --bit, direction ^= direction >> 1) {
      if (!(i & 1)) continue;
      x ^= 1u << bit;
      y ^= direction;
    }
  }
};

PointPatterns shifted_sobol_sets(int samples, bool is_disc) {
  return {samples, [is_disc](std::uint32_t set, int i) {
            Random random(set);
            const SobolPoint point(static_cast<std::uint32_t>(i));
            const auto fraction = [](std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; };
            const float u = fraction(point.x ^ random.bits());
            const float v = fraction(point.y ^ random.bits());
            return is_disc ? concentric(u, v) : SamplePoint{u, v};
          }};
}

class ReferenceQueries {
 public:
  ReferenceQueries(const ExactHits& hits, const EmbreeScene& embree, const PointPatterns& discs,
                   const PointPatterns& squares, int probing_samples)
      : hits_(hits), embree_(embree), discs_(discs), area_rays_(discs, squares), probing_samples_(probing_samples) {}

  void start(int samples, std::uint64_t half) {
    samples_ = samples, half_ = half, is_mixed_ = false, is_camera_ = true;
  }
  /// Whether any light since `start` was neither fully seen nor fully hidden.
  bool is_mixed() const { return is_mixed_; }

  std::optional<SurfaceHit> closest(const Vec3& origin, const Vec3& direction) {
    const double least = is_camera_ ? 0 : embree_.nudge();
    is_camera_ = false;
    return hits_.closest(origin, direction, least);
  }
  Vec3 leave(const SurfaceHit& hit, const Vec3&) const { return hit.position; }

  Color visibility(const SurfaceHit& hit, const Vec3& facing, const Vec3& axis, const Vec3& u, const Vec3& v,
                   double share, std::uint64_t place) {
    const Vec3 origin = off_surface(hit, facing);
    const Vec3 towards = axis - (origin - hit.position);
    const bool is_hard = u == Vec3{};
    const int count = is_hard ? 1 : enough_for(share);
    Random random = random_at(place);
    const std::uint32_t set = set_of_half(random);
    const DiscTarget target = DiscTarget{origin, towards, u, v}.turned(random.uniform());
    const int probes = std::min(count, probing_samples_);
    ShadowSum result = cast_shadow_rays(embree_, target, discs_.x(set), discs_.y(set), probes, 16);
    is_mixed_ = is_mixed_ || result.is_mixed;
    if (!result.is_mixed || probes == count) return result.sum * (1.0 / probes);
    result.sum +=
        cast_shadow_rays(embree_, target, discs_.x(set) + probes, discs_.y(set) + probes, count - probes, 16).sum;
    return result.sum * (1.0 / count);
  }

  Color irradiance(const SurfaceHit& hit, const Vec3& facing, const AreaLight& light, std::uint64_t place) {
    const Vec3 origin = off_surface(hit, facing);
    Random random = random_at(place);
    const std::uint32_t set = set_of_half(random);
    if (!area_rays_.aim(light, {origin, facing, hit.shading_normal}, set, random)) return math::black;
    const int probes = std::min(samples_, probing_samples_);
    ShadowSum result = cast_shadow_rays(embree_, origin, area_rays_.lanes(), 0, probes, 16);
    is_mixed_ = is_mixed_ || result.is_mixed;
    if (!result.is_mixed || probes == samples_) return result.sum * (area_rays_.solid_angle() / probes);
    result.sum += cast_shadow_rays(embree_, origin, area_rays_.lanes(), probes, samples_, 16).sum;
    return result.sum * (area_rays_.solid_angle() / samples_);
  }

 private:
  Random random_at(std::uint64_t place) const { return Random(place * 2 + half_ + 0x5eed); }
  /// The halves take sets of their own, even and odd.
  std::uint32_t set_of_half(Random& random) const {
    return static_cast<std::uint32_t>(random.bits() % (PointPatterns::count / 2) * 2 + half_);
  }
  /// Of the samples, as many as a light needs that adds so much at most: errors go like share · samples^-0.75.
  int enough_for(double share) const {
    constexpr double full_share = 1.0 / 32;
    constexpr int least = 8;
    const double wanted = samples_ * std::pow(std::min(1.0, share / full_share), 4.0 / 3);
    return std::min(samples_, std::max(least, static_cast<int>(wanted)));
  }

  const ExactHits& hits_;
  const EmbreeScene& embree_;
  const PointPatterns& discs_;
  AreaRays area_rays_;
  int probing_samples_;
  int samples_ = 1;
  std::uint64_t half_ = 0;
  bool is_mixed_ = false, is_camera_ = true;
};

void put(render::Film& film, std::size_t pixel, const Color& color) {
  film.rgb[3 * pixel] = static_cast<float>(color.r);
  film.rgb[3 * pixel + 1] = static_cast<float>(color.g);
  film.rgb[3 * pixel + 2] = static_cast<float>(color.b);
}

/// The pixels with a mark within `reach`.
std::vector<std::uint8_t> dilated(const std::vector<std::uint8_t>& marks, int width, int height, int reach) {
  std::vector<std::uint8_t> result(marks.size());
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      if (!marks[static_cast<std::size_t>(row * width + column)]) continue;
      for (int y = std::max(0, row - reach); y <= std::min(height - 1, row + reach); ++y) {
        for (int x = std::max(0, column - reach); x <= std::min(width - 1, column + reach); ++x) {
          result[static_cast<std::size_t>(y * width + x)] = 1;
        }
      }
    }
  }
  return result;
}

Reference make(const scene::Description& description, const FlatScene& flat, const ReferenceSettings& settings) {
  const ExactHits hits(flat);
  const EmbreeScene embree(flat, description.materials, {settings.threads, true});
  const ContractLights lights = lights_of(description);
  const PointPatterns discs = shifted_sobol_sets(settings.samples, true);
  const PointPatterns squares = shifted_sobol_sets(settings.samples, false);
  const PinholeCamera camera(description.camera, settings.width, settings.height);
  render::Film a(settings.width, settings.height), b(settings.width, settings.height);
  const std::size_t pixels = a.rgb.size() / 3;
  std::vector<std::uint8_t> mixed(pixels), wanted;
  const auto sweep = [&](bool is_scouting) {
    timed_in_pieces(pixels, settings.threads, [&](std::size_t first, std::size_t last) {
      ReferenceQueries queries(hits, embree, discs, squares, settings.probing_samples);
      ContractImage image(description, lights, queries);
      for (std::size_t i = first; i < last; ++i) {
        if (!is_scouting && !wanted[i]) continue;
        const int column = static_cast<int>(i) % settings.width, row = static_cast<int>(i) / settings.width;
        const auto value = [&](int samples, std::uint64_t half) {
          queries.start(samples, half);
          return image.radiance(camera.position(), camera.direction(column, row), i);
        };
        put(a, i, value(is_scouting ? settings.scouting_samples : settings.samples, 0));
        if (is_scouting) {
          mixed[i] = queries.is_mixed();
          std::copy_n(&a.rgb[3 * i], 3, &b.rgb[3 * i]);
        } else {
          put(b, i, value(settings.samples, 1));
        }
      }
    });
  };
  sweep(true);
  wanted = dilated(mixed, settings.width, settings.height, 2);
  sweep(false);
  Reference reference{render::Film(settings.width, settings.height), 0};
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    const double difference = static_cast<double>(std::clamp(a.rgb[i], 0.0f, 1.0f) - std::clamp(b.rgb[i], 0.0f, 1.0f));
    reference.squared_error += difference * difference / 4;
    reference.film.rgb[i] = (a.rgb[i] + b.rgb[i]) / 2;
  }
  reference.squared_error /= static_cast<double>(a.rgb.size());
  return reference;
}

}  // namespace

Reference reference_image(const scene::Description& description, const FlatScene& flat,
                          const ReferenceSettings& settings, const std::string& cache) {
  Reference reference{render::Film(settings.width, settings.height), 0};
  const auto bytes = static_cast<std::streamsize>(reference.film.rgb.size() * sizeof(float));
  if (std::ifstream file(cache, std::ios::binary);
      file.read(reinterpret_cast<char*>(&reference.squared_error), sizeof(double)) &&
      file.read(reinterpret_cast<char*>(reference.film.rgb.data()), bytes))
    return reference;
  std::fprintf(stderr, "making the reference %s\n", cache.c_str());
  reference = make(description, flat, settings);
  std::filesystem::create_directories(std::filesystem::path(cache).parent_path());
  std::ofstream file(cache, std::ios::binary);
  file.write(reinterpret_cast<const char*>(&reference.squared_error), sizeof(double));
  file.write(reinterpret_cast<const char*>(reference.film.rgb.data()), bytes);
  return reference;
}

}  // namespace penumbra::bench
