#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "server/cli/command.h"
#include "server/cli/input.h"

// Only a mistake in the flags' definitions throws outside the try blocks. NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  using namespace penumbra::cli;
  CLI::App program("Penumbra: a render server with exact soft shadows", "penumbra");
  program.set_version_flag("--version", "penumbra " PENUMBRA_VERSION);
  program.require_subcommand(1);
  program.footer("Every flag has a twin in the environment: --max-body is PENUMBRA_MAX_BODY.");
  const Command commands[] = {add_serve(program), add_render(program), add_validate(program), add_worker(program),
                              add_key(program)};
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? status_done : status_unusable;
  }
  try {
    for (const Command& command : commands) {
      if (!command.app->parsed()) continue;
      const int status = command.run();
      if (std::cout.flush()) return status;
      std::cerr << "penumbra: standard output cannot be written\n";
      return status_failed;
    }
  } catch (const UnusableArgument& error) {
    std::cerr << "penumbra: " << error.what() << "\n";
    return status_unusable;
  } catch (const std::exception& error) {
    std::cerr << "penumbra: " << error.what() << "\n";
  }
  return status_failed;
}
