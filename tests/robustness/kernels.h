#pragma once
#include <hwy/targets.h>

#include <string>
#include <vector>

namespace penumbra::test {

/// The engine's vector kernels bound to one instruction set, until the end of its life.
class Kernel {
 public:
  explicit Kernel(std::int64_t target) { hwy::GetChosenTarget().Update(target); }
  Kernel(const Kernel&) = delete;
  Kernel& operator=(const Kernel&) = delete;
  ~Kernel() { hwy::GetChosenTarget().Update(hwy::SupportedTargets()); }
};

/// The instruction sets the kernels are compiled for and this processor has: the plain loop, then ever wider vectors.
inline std::vector<std::int64_t> kernels() {
  std::vector<std::int64_t> targets;
  for (const std::int64_t target : {HWY_SCALAR, HWY_EMU128, HWY_SSSE3, HWY_SSE4, HWY_AVX2, HWY_AVX3}) {
    const std::int64_t usable = HWY_TARGETS & (hwy::SupportedTargets() | HWY_STATIC_TARGET);
    if ((usable & target) != 0) targets.push_back(target);
  }
  return targets;
}

inline std::string name_of(std::int64_t kernel) { return hwy::TargetName(kernel); }

}  // namespace penumbra::test
