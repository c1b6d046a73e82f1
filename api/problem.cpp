#include "api/problem.h"

#include <nlohmann/json.hpp>

namespace penumbra::api {

std::string to_json(const Problem& problem) {
  using nlohmann::ordered_json;
  ordered_json json{
      {"type", problem.type}, {"title", problem.title}, {"status", problem.status}, {"detail", problem.detail}};
  if (!problem.errors.empty()) {
    ordered_json& errors = json["errors"] = ordered_json::array();
    for (const FieldError& error : problem.errors) {
      errors.push_back(ordered_json{{"pointer", error.pointer}, {"detail", error.detail}});
    }
  }
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace penumbra::api
