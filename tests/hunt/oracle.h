#pragma once
#include <cstdint>
#include <vector>

#include "engine/scene/options.h"
#include "tests/hunt/bodies.h"
#include "tests/hunt/random.h"

namespace penumbra::hunt {

/// Light that arrives over an area: a disc's transmittance times `weight`, or an area light's integral.
struct Term {
  const scene::Light* light = nullptr;
  Color weight;  // of the disc: all but the shadow; of an area light: the path's factors
  Vec3 from, facing, view, shading;
  const scene::Material* material = nullptr;
  Vec3 towards;       // to the middle of a disc; unit for a directional light
  double radius = 0;  // of the disc
};

/// What one camera ray brings: what is exact, and what is left to be sampled.
struct Gathered {
  Color constant;
  std::vector<Term> terms;
  std::vector<double> trail;    // where the path met something; and
  std::uint64_t signature = 0;  // what it met, by which side, what hid the hard lights
  bool is_on_edge = false;      // a side test or a limit that rounding decides
};

/// A pixel's value; all in linear light, not clamped.
struct Estimate {
  Color mean, sigma;
  Color spread;      // Σ (weight² · share · (1 − share)): what a sampler of discs has to do with
  double stake = 0;  // what all of its light together could be
};

/// Section 2 of the contract by brute force, in plain doubles: no tree, no bundle, no closed form, nothing shared with
/// the engine but the description it reads.
class Oracle {
 public:
  Oracle(const scene::Description& scene, const scene::Options& options);

  /// Whether a pixel's value is an integral over its square or the lens, too.
  bool is_integrated() const;
  /// Light of the ray through a place of the picture, in pixels, and of the lens, in its radii.
  Gathered gather(double x, double y, double lens_x, double lens_y) const;
  /// `side`² well-spread samples of each term, `repeats` times; joint samples of pixel, lens and lights where the pixel
  /// is integrated. A term whose first `side`² samples agree gets no more of them unless `thorough`.
  Estimate pixel(int column, int row, int side, int repeats, bool thorough, Random& random) const;
  /// Whether a change of the camera ray by less than the engine's rounding may change what it sees.
  bool is_ambiguous(int column, int row) const;

 private:
  struct Path;
  struct Ray {
    Vec3 origin, direction;
  };
  Ray camera_ray(double x, double y, double lens_x, double lens_y) const;
  void follow(const Ray& ray, const Path& path, Gathered& out) const;
  void light(const Path& path, const struct Meeting& at, Gathered& out) const;
  void hard_or_disc(const Path& path, const struct Meeting& at, const scene::Light& light, Gathered& out) const;
  Color transmittance(const Vec3& from, const Vec3& facing, const Color& own, const Vec3& way, bool is_endless,
                      std::uint64_t* signature) const;
  Color sample(const Term& term, double u, double v, Color& open) const;
  Color area_sample(const Term& term, const Vec3& way, double weight, Color& open) const;
  Color rectangle_sample(const Term& term, const scene::RectangleLight& light, double u, double v, Color& open) const;
  Color sphere_sample(const Term& term, const scene::SphereLight& light, double u, double v, Color& open) const;
  void add_term(const Term& term, int side, int repeats, bool thorough, Random& random, Estimate& sum) const;
  Estimate integrated(int column, int row, int count, Random& random) const;

  const scene::Description& scene_;
  const scene::Options& options_;
  Frame frame_;
  Bodies bodies_;
  double touch_;  // what is nearer coincides; what is apart is farther by orders of magnitude
  mutable std::vector<Crossing> found_;
};

}  // namespace penumbra::hunt
