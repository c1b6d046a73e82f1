#pragma once
#include "tests/hunt/judge.h"

namespace penumbra::hunt {

/// More samples of the soft lights bring the picture nearer to the truth.
void check_samples(const api::JobRequest& job, Renderer& renderer, const Judge& judge, Report& report);

/// Pictures large enough to tell: the error a render reports is the one it has, by a factor of two either way; and
/// where it has a target, that is met as far as the caps allow.
void check_estimate(const api::JobRequest& job, Renderer& renderer, std::uint64_t seed, Report& report);

}  // namespace penumbra::hunt
