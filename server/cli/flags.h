#pragma once
#include "api/job_request.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace penumbra::cli {

/// A flag for each limit of what a body may ask for.
void add_limit_flags(CLI::App& command, api::Limits& limits);

/// Those of files that are the user's own: of any size.
api::Limits limits_of_own_files();

/// --threads with the meanings that the option `threads` has.
void add_threads_flag(CLI::App& command, int& threads);

/// Lets no infinity and nothing that is no number pass, which ranges do.
CLI::Option* require_finite(CLI::Option* option);

/// Gives every flag that has been added its environment twin: --max-body is PENUMBRA_MAX_BODY.
void add_environment_twins(CLI::App& command);

}  // namespace penumbra::cli
