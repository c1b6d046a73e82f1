#pragma once
#include "tests/hunt/judge.h"

namespace penumbra::hunt {

/// What may be asked of a scene; a kind of finding each, so that a shrinking scene is asked the one question.
enum class Check : unsigned { structures = 1, switches = 2, pixels = 4, samples = 8, estimate = 16, all = 31 };

/// Everything the contract promises of the job's picture. `seed` chooses what is left to chance.
Report examine(const api::JobRequest& job, std::uint64_t seed, Check checks);

/// The check that tells of findings of this kind.
Check check_of(const std::string& kind);

}  // namespace penumbra::hunt
