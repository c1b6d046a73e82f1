#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "api/job_request.h"
#include "server/cli/command.h"
#include "server/cli/flags.h"
#include "server/cli/input.h"

namespace penumbra::cli {

namespace {

struct ValidateSettings {
  std::string job;
  api::Limits limits = limits_of_own_files();
};

int validate(const ValidateSettings& settings) {
  const std::string body = read_input(settings.job, settings.limits.max_body_bytes);
  try {
    std::cout << api::to_json(api::estimate_cost(api::parse_job(body, settings.limits))) << "\n";
    return status_done;
  } catch (const api::InvalidBody& invalid) {
    print_errors(invalid.problem(), std::cout);
    return status_unusable;
  }
}

}  // namespace

Command add_validate(CLI::App& program) {
  const auto settings = std::make_shared<ValidateSettings>();
  CLI::App* command = program.add_subcommand(
      "validate", "Check a job: print every error with its pointer, one a line, or the cost estimate");
  command->add_option("job", settings->job, "The job as JSON; - is standard input")->required()->type_name("JOB.json");
  add_limit_flags(*command, settings->limits);
  add_environment_twins(*command);
  return {command, [settings] { return validate(*settings); }};
}

}  // namespace penumbra::cli
