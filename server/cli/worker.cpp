#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "server/cli/command.h"
#include "server/cli/flags.h"

namespace penumbra::cli {

Command add_worker(CLI::App& program) {
  struct WorkerSettings {
    std::string store;
    int threads = -1;
  };
  const auto settings = std::make_shared<WorkerSettings>();
  CLI::App* command = program.add_subcommand("worker", "Render jobs of a shared store (not part of this version)");
  command->add_option("--store", settings->store, "postgresql://…");
  add_threads_flag(*command, settings->threads);
  add_environment_twins(*command);
  return {command, [settings] {
            std::cerr << "penumbra worker: --store " << settings->store
                      << ": the PostgreSQL store is not part of this version\n";
            return status_unusable;
          }};
}

}  // namespace penumbra::cli
