#include "api/nearest.h"

#include <doctest/doctest.h>

#include <vector>

#include "api/fields.h"
#include "api/job_request.h"
#include "api/problem.h"

using namespace penumbra::api;

TEST_CASE("the word that was probably meant") {
  const std::vector<std::string_view> words{"width",     "height", "shadow_samples", "samples_per_pixel",
                                            "max_depth", "up"};
  for (const auto& [written, meant] : std::vector<std::pair<const char*, const char*>>{
           {"widht", "width"},                   // two neighbours swapped
           {"with", "width"},                    // a letter missing
           {"heightt", "height"},                // one too many
           {"shadow_sample", "shadow_samples"},  // the end missing
           {"shadowSamples", "shadow_samples"},  // another custom of writing
           {"Max-Depth", "max_depth"},           //
           {"samples_per_pixels", "samples_per_pixel"}}) {
    CHECK(nearest(written, words) == std::string_view(meant));
  }
  // Too far from all, and too short to be more than one letter from something.
  for (const char* written : {"", "u", "xy", "denoise", "radius", "w"}) CHECK_FALSE(nearest(written, words));
  CHECK_FALSE(nearest(std::string(100'000, 'x'), words));
  CHECK_FALSE(nearest("width", {}));
  CHECK(did_you_mean("widht", words) == "; did you mean \"width\"?");
  CHECK(did_you_mean("denoise", words).empty());
}

TEST_CASE("a member that is not known is answered with the one that was probably meant there") {
  const std::string body = R"({"scene": {"camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40},
    "objects": [{"type": "sphere", "centre": [0, 0, 0], "center": [0, 0, 0], "radius": 1, "normal": 1}]},
    "options": {"shadowSamples": 4}})";
  try {
    parse_job(body);
    FAIL("it was accepted");
  } catch (const InvalidBody& invalid) {
    std::vector<FieldError> errors = invalid.problem().errors;
    const auto detail_at = [&](const std::string& pointer) {
      for (const FieldError& error : errors) {
        if (error.pointer == pointer) return error.detail;
      }
      return std::string();
    };
    CHECK(detail_at("/scene/objects/0/centre") == "is not a known field; did you mean \"center\"?");
    CHECK(detail_at("/scene/objects/0/normal") == "is not a known field");
    CHECK(detail_at("/options/shadowSamples") == "is not a known field; did you mean \"shadow_samples\"?");
  }
}

TEST_CASE("what is quoted is cut after forty bytes, and not within a character") {
  for (const auto& [given, expected] : std::vector<std::pair<std::string, std::string>>{
           {std::string(40, 'x'), "\"" + std::string(40, 'x') + "\""},
           {std::string(41, 'x'), "\"" + std::string(40, 'x') + "…\""},
           {std::string(39, 'x') + "ß", "\"" + std::string(39, 'x') + "…\""},
           {std::string(38, 'x') + "ßx", "\"" + std::string(38, 'x') + "ß…\""}}) {
    CHECK(quoted(given) == expected);
  }
}
