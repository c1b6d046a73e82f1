#pragma once
#include <cstdint>

namespace penumbra::sampling {

/// A stream of randomness named by where it is used: seed, pixel, path, light. Equal names give equal numbers on every
/// machine and in every thread.
class Key {
 public:
  explicit Key(std::uint64_t seed) : state_(mix(seed + 0x9e3779b97f4a7c15u)) {}
  /// The key of a place inside this one.
  Key at(std::uint64_t place) const { return Key(state_ ^ mix(place + 0x632be59bd9b4e019u), {}); }
  std::uint64_t bits() const { return state_; }
  std::uint32_t bits32(int which) const {
    return static_cast<std::uint32_t>(mix(state_ + static_cast<std::uint64_t>(which)) >> 32);
  }
  /// In [0, 1).
  double uniform(int which) const {
    return static_cast<double>(mix(state_ + static_cast<std::uint64_t>(which)) >> 11) * 0x1p-53;
  }

 private:
  struct Raw {};
  Key(std::uint64_t state, Raw) : state_(mix(state)) {}
  /// Stafford's variant 13 of the 64-bit finaliser of MurmurHash3, as in SplitMix64.
  static std::uint64_t mix(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  }
  std::uint64_t state_;
};

/// A place inside a key, whose own key is only made when it is wanted.
struct Place {
  const Key& of;
  std::uint64_t name;
  Key key() const { return of.at(name); }
};

}  // namespace penumbra::sampling
