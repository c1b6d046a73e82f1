#pragma once
#include <cassert>
#include <cstdint>

#include "engine/sampling/sobol.h"

namespace penumbra::sampling {

/// A stream of randomness named by where it is used: seed, pixel, path, light. Equal names give equal numbers on every
/// machine and in every thread. Of a pixel's camera samples each has its own: their numbers of one name are spread
/// well.
class Key {
 public:
  explicit Key(std::uint64_t seed) : state_(mix(seed + 0x9e3779b97f4a7c15u)) {}
  /// The key of a place inside this one.
  Key at(std::uint64_t place) const { return {state_ ^ mix(place + 0x632be59bd9b4e019u), sample_}; }
  /// The same name for the camera sample `index`.
  Key of_sample(std::uint32_t index) const {
    Key result = *this;
    result.sample_ = index;
    return result;
  }
  std::uint32_t sample() const { return sample_; }
  std::uint64_t bits() const { return state_; }
  std::uint32_t bits32(int which) const {
    return static_cast<std::uint32_t>(mix(state_ + static_cast<std::uint64_t>(which)) >> 32);
  }
  /// In [0, 1), `which` is 0 or 1: of the camera sample's point in six dimensions (see CameraPattern) the last two,
  /// under a scrambling of this name's own.
  double uniform(int which) const {
    assert(which == 0 || which == 1);
    return owen(sobol(sample_, first_light_dimension + static_cast<std::size_t>(which)), bits32(which)) * 0x1p-32;
  }

 private:
  static constexpr std::size_t first_light_dimension = 4;
  Key(std::uint64_t state, std::uint32_t sample) : state_(mix(state)), sample_(sample) {}
  /// Stafford's variant 13 of the 64-bit finaliser of MurmurHash3, as in SplitMix64.
  static std::uint64_t mix(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  }
  std::uint64_t state_;
  std::uint32_t sample_ = 0;
};

/// A place inside a key, whose own key is only made when it is wanted.
struct Place {
  const Key& of;
  std::uint64_t name;
  Key key() const { return of.at(name); }
};

}  // namespace penumbra::sampling
