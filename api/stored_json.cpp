#include "api/stored_json.h"

#include <nlohmann/json.hpp>
#include <stdexcept>

namespace penumbra::api {

namespace {

using nlohmann::json;

template <class Read>
auto read(std::string_view text, const Read& read_value) {
  try {
    return read_value(json::parse(text));
  } catch (const json::exception&) {
    throw std::runtime_error("a stored record is damaged");
  }
}

}  // namespace

Problem problem_of(std::string_view text) {
  return read(text, [](const json& value) {
    Problem problem{value.at("type"), value.at("title"), value.at("status"), value.at("detail"), {}};
    for (const json& error : value.value("errors", json::array()))
      problem.errors.push_back({error.at("pointer"), error.at("detail")});
    return problem;
  });
}

render::Stats stats_of(std::string_view text) {
  return read(text, [](const json& value) {
    const json& rays = value.at("rays");
    render::Stats stats;
    stats.build_s = value.at("build_s");
    stats.render_s = value.at("render_s");
    stats.encode_s = value.at("encode_s");
    stats.rays = {rays.at("camera"), rays.at("shadow"), rays.at("reflection"), rays.at("transmission")};
    for (const auto& [name, count] : value.at("skipped").items()) stats.skipped[name] = count;
    // Not a number has no form in JSON.
    if (value.at("estimated_error").is_number()) stats.estimated_error = value.at("estimated_error");
    return stats;
  });
}

}  // namespace penumbra::api
