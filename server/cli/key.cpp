#include "server/access/key.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "server/access/key_ring.h"
#include "server/cli/command.h"
#include "server/cli/flags.h"
#include "server/cli/input.h"

namespace penumbra::cli {

namespace {

struct KeySettings {
  std::string file, owner, id;
  std::vector<std::string> scopes{"jobs:read", "jobs:write"};
  int requests_per_minute = 0;
  std::size_t max_jobs = 0;
};

std::vector<access::Key> keys_of(const std::string& file) {
  try {
    return access::parse_keys(access::read_keys(file));
  } catch (const std::runtime_error& error) {
    throw UnusableArgument("--keys " + file + ": " + error.what());
  }
}

int create(const KeySettings& settings) {
  std::vector<access::Scope> scopes;
  for (const std::string& name : settings.scopes) scopes.push_back(*access::scope_of(name));
  access::NewKey made = access::make_key(settings.owner, std::move(scopes));
  if (settings.requests_per_minute > 0) made.key.requests_per_minute = settings.requests_per_minute;
  if (settings.max_jobs > 0) made.key.max_jobs = settings.max_jobs;
  // Comments and whatever else is in the file stay there.
  std::string text;
  if (std::filesystem::exists(settings.file)) {
    keys_of(settings.file);
    text = access::read_keys(settings.file);
  }
  if (!text.empty() && !text.ends_with('\n')) text += '\n';
  access::write_keys(settings.file, text + access::line_of(made.key) + "\n");
  std::cout << made.text << "\n";
  return status_done;
}

int list(const KeySettings& settings) {
  for (const access::Key& key : keys_of(settings.file)) {
    // Without the hash, which is nobody's business.
    std::cout << key.id << access::line_of(key).substr(key.id.size() + 1 + key.sha256.size()) << "\n";
  }
  return status_done;
}

int revoke(const KeySettings& settings) {
  const std::vector<access::Key> keys = keys_of(settings.file);
  if (std::none_of(keys.begin(), keys.end(), [&](const access::Key& key) { return key.id == settings.id; }))
    throw UnusableArgument("there is no key " + settings.id + " in " + settings.file);
  std::string kept;
  std::istringstream lines(access::read_keys(settings.file));
  for (std::string line; std::getline(lines, line);) {
    std::string first;
    if (std::istringstream(line) >> first && first == settings.id) continue;
    kept += line + "\n";
  }
  // An empty file is taken for one that was cut off.
  if (kept.find_first_not_of(" \t\r\n") == std::string::npos) kept = "# no keys\n";
  access::write_keys(settings.file, kept);
  return status_done;
}

}  // namespace

Command add_key(CLI::App& program) {
  const auto settings = std::make_shared<KeySettings>();
  CLI::App* command = program.add_subcommand("key", "Make, list and revoke the keys of `serve --keys`");
  command->require_subcommand(1);
  const auto add = [&](const char* name, const char* description) {
    CLI::App* sub = command->add_subcommand(name, description);
    sub->add_option("--keys", settings->file, "The file of keys; it holds SHA-256 sums, not the keys")
        ->required()
        ->type_name("FILE");
    return sub;
  };
  CLI::App* make = add("create", "Print a new key once, and add it to the file");
  make->add_option("--owner", settings->owner, "Whose jobs are made with it; owners do not see each other's")
      ->required()
      ->check([](const std::string& name) {
        return access::is_owner(name) ? "" : std::string("up to 64 letters, digits and . _ - @ +");
      });
  make->add_option("--scopes", settings->scopes, "What it may do: jobs:read, jobs:write, metrics, admin")
      ->delimiter(',')
      ->check(CLI::IsMember({"jobs:read", "jobs:write", "metrics", "admin"}))
      ->capture_default_str();
  make->add_option("--max-requests", settings->requests_per_minute, "Requests a minute; 0: as the server says")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  make->add_option("--max-jobs", settings->max_jobs, "Unfinished jobs; 0: as the server says")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  CLI::App* show = add("list", "Print id, owner, scopes and limits of each key");
  CLI::App* remove = add("revoke", "Take a key out of the file");
  remove->add_option("id", settings->id, "Its id: the part between rs_ and the next _")->required();
  for (CLI::App* sub : {make, show, remove}) add_environment_twins(*sub);
  return {command, [=] {
            if (make->parsed()) return create(*settings);
            return show->parsed() ? list(*settings) : revoke(*settings);
          }};
}

}  // namespace penumbra::cli
