#pragma once
#include <array>
#include <cstdint>

/// Sobol' points in base 2 and their scrambling, a dimension at a time: bits of a number in [0, 1), the highest first.
namespace penumbra::sampling {

inline constexpr std::size_t sobol_dimensions = 6;

/// Where bit i of an index is set, bits [i] are flipped. The matrices of Joe, Kuo, "Constructing Sobol Sequences with
/// Better Two-Dimensional Projections", SIAM J. Sci. Comput. 30, 2008.
using SobolMatrix = std::array<std::uint32_t, 32>;

/// `coefficients` of the primitive polynomial of that degree, its first and last left out, and the first numbers m.
template <std::size_t degree>
constexpr SobolMatrix sobol_matrix(std::uint32_t coefficients, const std::array<std::uint32_t, degree>& first) {
  std::array<std::uint32_t, 32> m{};
  SobolMatrix bits{};
  for (std::size_t i = 0; i < 32; ++i) {
    if (i < degree) {
      m[i] = first[i];
    } else {
      m[i] = m[i - degree] ^ (m[i - degree] << degree);
      for (std::size_t k = 1; k < degree; ++k) {
        if ((coefficients >> (degree - 1 - k) & 1) != 0) m[i] ^= m[i - k] << k;
      }
    }
    bits[i] = m[i] << (31 - i);
  }
  return bits;
}

constexpr SobolMatrix van_der_corput() {
  SobolMatrix bits{};
  for (std::size_t i = 0; i < 32; ++i) bits[i] = 0x80000000u >> i;
  return bits;
}

inline constexpr std::array<SobolMatrix, sobol_dimensions> sobol_matrices{van_der_corput(),
                                                                          sobol_matrix<1>(0, {1}),
                                                                          sobol_matrix<2>(1, {1, 3}),
                                                                          sobol_matrix<3>(1, {1, 3, 1}),
                                                                          sobol_matrix<3>(2, {1, 1, 1}),
                                                                          sobol_matrix<4>(1, {1, 1, 3, 3})};

inline std::uint32_t sobol(std::uint32_t index, std::size_t dimension) {
  std::uint32_t result = 0;
  for (const std::uint32_t* bits = sobol_matrices[dimension].data(); index != 0; index >>= 1, ++bits) {
    if ((index & 1u) != 0) result ^= *bits;
  }
  return result;
}

inline std::uint32_t reverse_bits(std::uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
  return (x >> 16) | (x << 16);
}

/// Nested uniform scrambling: each bit is flipped by a hash of those above it. Burley, "Practical Hash-based Owen
/// Scrambling", JCGT 9(4), 2020, with the constants of Vegdahl's improvement of Laine and Karras.
inline std::uint32_t owen(std::uint32_t bits, std::uint32_t seed) {
  std::uint32_t x = reverse_bits(bits);
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return reverse_bits(x);
}

}  // namespace penumbra::sampling
