#pragma once
#include "api/job_request.h"

namespace CLI {
class App;
}

namespace penumbra::cli {

/// A flag for each limit of what a body may ask for.
void add_limit_flags(CLI::App& command, api::Limits& limits);

/// --threads with the meanings that the option `threads` has.
void add_threads_flag(CLI::App& command, int& threads);

/// Gives every flag that has been added its environment twin: --max-body is PENUMBRA_MAX_BODY.
void add_environment_twins(CLI::App& command);

}  // namespace penumbra::cli
