#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>

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

}  // namespace

TEST_CASE("every good body of the corpus is accepted") {
  const auto corpus = tests::read_corpus("good.json");
  CHECK(corpus.size() >= 60);
  for (const tests::CorpusEntry& entry : corpus) {
    const std::optional<api::Problem> problem = refusal(entry.body);
    CHECK_MESSAGE(!problem, entry.name << ": " << (problem ? to_json(*problem) : ""));
  }
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
