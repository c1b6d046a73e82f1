// What every file has in common that is compiled once per instruction set, the best of which is chosen at run time.
// Such a file names itself, and then includes this one before anything else:
//   #undef HWY_TARGET_INCLUDE
//   #define HWY_TARGET_INCLUDE "engine/accel/nearest_walk.cpp"
//   #include "engine/accel/simd-inl.h"
// Its kernels stand in an anonymous namespace inside HWY_NAMESPACE, and HWY_EXPORT at its end, #if HWY_ONCE.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

#if defined(PENUMBRA_ACCEL_SIMD) == defined(HWY_TARGET_TOGGLE)
#ifdef PENUMBRA_ACCEL_SIMD
#undef PENUMBRA_ACCEL_SIMD
#else
#define PENUMBRA_ACCEL_SIMD
#endif

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace penumbra::simd::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// One bit for each of at most eight lanes.
template <class D>
HWY_INLINE unsigned bits(D d, hn::Mask<D> mask) {
  std::uint8_t bytes[8]{};
  hn::StoreMaskBits(d, mask, bytes);
  return bytes[0];
}

}  // namespace
}  // namespace penumbra::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
