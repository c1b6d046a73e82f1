#include "server/cli/program.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "api/nearest.h"
#include "api/version.h"
#include "server/cli/command.h"
#include "server/cli/input.h"

namespace penumbra::cli {

namespace {

/// CLI11's message; of a word that no command knows, what was probably meant by it.
std::string complaint(const CLI::App* program, const CLI::Error& error) {
  const CLI::App* command = program;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  std::string message = error.what();
  const std::vector<std::string> unknown = command->remaining();
  const auto is_flag = [](const std::string& word) { return word.starts_with("-"); };
  const auto flag = std::find_if(unknown.begin(), unknown.end(), is_flag);
  const auto word = std::find_if_not(unknown.begin(), unknown.end(), is_flag);
  std::vector<std::string> names;
  for (const CLI::App* each : command->get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(each->get_name());
  const auto did_you_mean = [&](const std::string& written) {
    return api::did_you_mean(written, std::vector<std::string_view>(names.begin(), names.end()));
  };
  if (!names.empty() && word != unknown.end()) {
    message = "there is no command " + *word + did_you_mean(*word);
  } else if (flag != unknown.end()) {
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
    const std::string name = flag->substr(0, flag->find('='));
    message = "there is no flag " + name + did_you_mean(name);
  }
  return "penumbra: " + message + "\nRun with --help for more information.\n";
}

}  // namespace

int run(int argc, const char* const* argv) {
  CLI::App program("Penumbra: a render server with exact soft shadows", "penumbra");
  program.set_version_flag("--version", api::program_name());
  program.require_subcommand(1);
  program.failure_message(complaint);
  program.footer("Every flag has a twin in the environment: --max-body is PENUMBRA_MAX_BODY.");
  const Command commands[] = {add_serve(program),  add_render(program), add_validate(program),
                              add_worker(program), add_key(program),    add_completion(program)};
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

}  // namespace penumbra::cli
