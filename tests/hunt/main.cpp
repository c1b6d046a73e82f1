// The hunter: random scenes against the contract. tests/hunt/run says how it is started.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "tests/hunt/hunt.h"

int main(int argc, char** argv) {
  using namespace penumbra::hunt;
  Plan plan;
  bool lists = false;
  std::vector<std::string> names;
  for (const Profile& profile : profiles()) names.emplace_back(profile.name);
  CLI::App app("Random scenes, each compared with brute force and with itself");
  app.add_option("--seconds", plan.seconds, "how long new scenes are started")->capture_default_str();
  app.add_option("--count", plan.count, "so many scenes instead");
  app.add_option("--seed", plan.seed, "of all scenes")->capture_default_str();
  app.add_option("--index", plan.index, "this scene of the seed alone, which is printed, too");
  app.add_option("--profile", plan.profile, "scenes of one kind alone")->check(CLI::IsMember(names));
  app.add_option("--out", plan.folder, "where findings are written")->capture_default_str();
  app.add_option("--jobs", plan.workers, "processes at a time")->capture_default_str()->check(CLI::PositiveNumber);
  app.add_option("--shrink", plan.shrink_s, "seconds for a finding to become small; 0: as it is")
      ->capture_default_str();
  app.add_option("--scene", plan.files, "written jobs instead of random scenes")->check(CLI::ExistingFile);
  app.add_flag("--list", lists, "the kinds of scenes");
  CLI11_PARSE(app, argc, argv);
  if (lists) {
    for (const std::string& name : names) std::puts(name.c_str());
    return 0;
  }
  return plan.files.empty() ? hunt(plan) : judge_files(plan);
}
