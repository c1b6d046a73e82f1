// Recipe 7: the plain loop and every width of vector give the same picture, whatever is switched off.
#include "tests/robustness/kernels.h"

#include <doctest/doctest.h>

#include <filesystem>

#include "tests/robustness/worlds.h"
#include "tests/support/picture.h"
#include "tests/support/scenes.h"

using namespace penumbra;

namespace {

std::vector<std::pair<std::string, api::JobRequest>> every_scene() {
  std::vector<std::pair<std::string, api::JobRequest>> jobs{{"zoo", test::zoo()}};
  for (const auto& entry : std::filesystem::directory_iterator(PENUMBRA_SOURCE_DIR "/clients/scenes")) {
    const std::filesystem::path& path = entry.path();
    if (path.extension() == ".json") jobs.emplace_back(path.stem(), test::example(path.stem()));
  }
  return jobs;
}

}  // namespace

TEST_CASE("recipe 7: every kernel gives the same bytes for every scene, with and without each shortcut") {
  const std::vector<std::int64_t> kernels = test::kernels();
  std::string names;
  for (const std::int64_t instructions : kernels) names += " " + test::name_of(instructions);
  MESSAGE("kernels:", names);
  const int size = test::count(20, 128);
  for (auto& [name, job] : every_scene()) {
    job.options.width = job.options.height = size;
    job.options.shadow_samples = test::count(4, 16);
    for (const bool shadow_candidates : {true, false}) {
      for (const bool merge_lights : {true, false}) {
        render::Switches switches = test::with_candidates(shadow_candidates);
        switches.merge_lights = merge_lights;
        render::Film::Values plain;
        for (const std::int64_t instructions : kernels) {
          const test::Kernel kernel(instructions);
          const render::Film::Values picture = test::render(job, switches).film->rgb;
          if (plain.empty()) plain = picture;
          INFO(name, ", ", test::name_of(instructions), ", candidates ", shadow_candidates, ", merged lights ",
               merge_lights);
          CHECK(picture == plain);
        }
      }
    }
  }
}
