#pragma once
#include "tests/hunt/checks.h"
#include "tests/hunt/maker.h"

namespace penumbra::hunt {

/// The smallest scene found within `seconds` of which `finding` is still true, and the finding as it is then.
struct Shrunk {
  Json job;
  Finding finding;
};
Shrunk shrink(const Json& job, const Finding& finding, std::uint64_t seed, double seconds);

}  // namespace penumbra::hunt
