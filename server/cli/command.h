#pragma once
#include <functional>

namespace CLI {
class App;
}

namespace penumbra::cli {

inline constexpr int status_done = 0, status_failed = 1, status_unusable = 2;

/// A subcommand: its flags are those of `app`, and `run` does what it is for once they are parsed. Returns an exit
/// status; may throw std::exception, which means failed.
struct Command {
  CLI::App* app;
  std::function<int()> run;
};

Command add_serve(CLI::App& program);
Command add_render(CLI::App& program);
Command add_validate(CLI::App& program);
Command add_worker(CLI::App& program);
Command add_key(CLI::App& program);
Command add_completion(CLI::App& program);

}  // namespace penumbra::cli
