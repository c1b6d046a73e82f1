#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tests/hunt/maker.h"

namespace penumbra::hunt {

struct Plan {
  double seconds = 60;
  std::optional<long> count;  // of scenes, instead of a time
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> index;  // this scene alone
  std::string profile;                 // of these alone
  std::string folder = "build/hunt";
  int workers = 2;
  double shrink_s = 40;  // for each finding, and of each kind and profile only the first ones
  std::vector<std::string> files;
};

/// Examines scene after scene, each in a process of its own, and prints what was found. The exit status.
int hunt(const Plan& plan);
/// The same for written scenes.
int judge_files(const Plan& plan);

}  // namespace penumbra::hunt
