#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace penumbra::accel {

/// Calls task(0) … task(count − 1), each once, perhaps on several threads; returns when all have returned.
using ParallelFor = std::function<void(std::int64_t count, const std::function<void(std::int64_t)>& task)>;
void run_in_turn(std::int64_t count, const std::function<void(std::int64_t)>& task);

/// Entries a task takes when a pass over many is shared.
inline constexpr std::size_t chunk = 1 << 14;

inline std::size_t chunks_of(std::size_t count) { return (count + chunk - 1) / chunk; }

/// Calls use(k, from, to) for the k-th chunk [from, to) of [0, count), for all of them.
template <class Use>
void in_chunks(std::size_t count, const ParallelFor& parallel_for, const Use& use) {
  const auto task = [&](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    use(k, k * chunk, std::min(count, (k + 1) * chunk));
  };
  if (count > chunk) {
    parallel_for(static_cast<std::int64_t>(chunks_of(count)), task);
  } else if (count > 0) {
    task(0);
  }
}

}  // namespace penumbra::accel
