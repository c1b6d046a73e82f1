#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <variant>

#include "api/job_request.h"
#include "api/problem.h"
#include "tests/api/corpus.h"

using namespace penumbra;

namespace {

std::optional<api::Problem> refusal(const std::string& body) {
  try {
    api::parse_job(body);
  } catch (const api::InvalidBody& error) {
    return error.problem();
  }
  return std::nullopt;
}

std::vector<std::string> sorted_pointers(const api::Problem& problem) {
  std::vector<std::string> pointers;
  for (const api::FieldError& error : problem.errors) pointers.push_back(error.pointer);
  std::sort(pointers.begin(), pointers.end());
  return pointers;
}

/// By their places in the variants.
struct Kinds {
  std::set<std::size_t> shapes, lights;
};

void note(const std::vector<scene::Object>& objects, Kinds& kinds) {
  for (const scene::Object& object : objects) {
    kinds.shapes.insert(object.shape.index());
    if (const auto* group = std::get_if<scene::Group>(&object.shape)) note(group->objects, kinds);
  }
}

/// Option by option, whether it is not what it is by default. One more, and this no longer compiles.
std::vector<bool> chosen(const scene::Options& options) {
  const auto& [width, height, samples, shadow_samples, target_error, time_budget_s, max_depth, min_contribution,
               threads, acceleration, seed, exposure, transfer, format, bit_depth, progress_interval_s, priority] =
      options;
  const scene::Options plain;
  return {width != plain.width,
          height != plain.height,
          samples != plain.samples_per_pixel,
          shadow_samples != plain.shadow_samples,
          target_error.has_value(),
          time_budget_s.has_value(),
          max_depth != plain.max_depth,
          min_contribution != plain.min_contribution,
          threads != plain.threads,
          acceleration != plain.acceleration,
          seed != plain.seed,
          exposure != plain.exposure,
          transfer != plain.transfer,
          format != plain.format,
          bit_depth != plain.bit_depth,
          progress_interval_s != plain.progress_interval_s,
          priority != plain.priority};
}

}  // namespace

TEST_CASE("every good body of the corpus is accepted") {
  const auto corpus = tests::read_corpus("good.json");
  CHECK(corpus.size() >= 60);
  for (const tests::CorpusEntry& entry : corpus) {
    const std::optional<api::Problem> problem = refusal(entry.body);
    CHECK_MESSAGE(!problem, entry.name << ": " << (problem ? to_json(*problem) : ""));
  }
}

TEST_CASE("the corpus knows every shape, light and option, so that tests/api/run finds those the schema forgets") {
  Kinds kinds;
  std::vector<bool> is_chosen(chosen({}).size());
  for (const tests::CorpusEntry& entry : tests::read_corpus("good.json")) {
    const api::JobRequest request = api::parse_job(entry.body);
    note(request.scene.objects, kinds);
    for (const scene::Light& light : request.scene.lights) kinds.lights.insert(light.index());
    const std::vector<bool> here = chosen(request.options);
    for (std::size_t i = 0; i < here.size(); ++i) is_chosen[i] = is_chosen[i] || here[i];
  }
  CHECK(kinds.shapes.size() == std::variant_size_v<scene::Shape>);
  CHECK(kinds.lights.size() == std::variant_size_v<scene::Light>);
  CHECK(std::ranges::count(is_chosen, false) == 0);
}

TEST_CASE("every bad body of the corpus is refused with its status and exactly its pointers") {
  const auto corpus = tests::read_corpus("bad.json");
  CHECK(corpus.size() >= 120);
  for (const tests::CorpusEntry& entry : corpus) {
    const std::optional<api::Problem> problem = refusal(entry.body);
    CHECK_MESSAGE(problem, entry.name);
    if (!problem) continue;
    CHECK_MESSAGE(problem->status == entry.status, entry.name << ": " << to_json(*problem));
    CHECK_MESSAGE(sorted_pointers(*problem) == entry.pointers, entry.name << ": " << to_json(*problem));
    CHECK_MESSAGE(!problem->detail.empty(), entry.name);
    CHECK_MESSAGE(problem->type.rfind("/problems/", 0) == 0, entry.name);
  }
}

TEST_CASE("every example scene is accepted") {
  int scenes = 0;
  const std::filesystem::path folder = std::string(PENUMBRA_SOURCE_DIR) + "/clients/scenes";
  if (std::filesystem::exists(folder)) {
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
      if (file.path().extension() != ".json") continue;
      ++scenes;
      const auto problem = refusal(tests::read_source_file("clients/scenes/" + file.path().filename().string()));
      CHECK_MESSAGE(!problem, file.path().filename().string() << ": " << (problem ? to_json(*problem) : ""));
    }
  }
  CHECK(scenes >= 11);
}
