#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <set>

#include "api/problems.h"
#include "tests/server/fixture.h"

using nlohmann::json;
using namespace penumbra;

namespace {

json document_of(const TestServer& server) { return json::parse(call(server.port(), "GET", "/v1/openapi.json").body); }

const json& resolved(const json& document, const json& value) {
  if (!value.contains("$ref")) return value;
  return document.at(json::json_pointer(value.at("$ref").get<std::string>().substr(1)));
}

/// Calls `look` with the path, the method and the operation of each.
template <typename Look>
void for_each_operation(const json& document, const Look& look) {
  for (const auto& [path, item] : document.at("paths").items()) {
    for (const auto& [method, operation] : item.items()) {
      if (method != "parameters") look(path, method, operation);
    }
  }
}

/// The names of the parameters of an operation that stand in this place.
std::set<std::string> parameters_in(const json& document, const json& operation, std::string_view place) {
  std::set<std::string> names;
  for (const json& parameter : operation.value("parameters", json::array())) {
    const json& value = resolved(document, parameter);
    if (value.at("in") == place) names.insert(value.at("name"));
  }
  return names;
}

/// The ways to be allowed to call a route, as the document says them.
json security_of(const http::Route& route) {
  if (!route.scope) return json::array();
  const json scopes{access::name_of(*route.scope)};
  json ways{json::object(), {{"apiKey", scopes}}};
  if (route.takes_token) ways.push_back({{"accessToken", scopes}});
  return ways;
}

}  // namespace

TEST_CASE("the document and the table of problem types say the same") {
  const TestServer server;
  const json document = document_of(server);
  std::vector<json> said, made;
  for (const json& type : document.at("/components/schemas/ProblemType/anyOf"_json_pointer)) {
    if (!type.contains("const")) continue;
    said.push_back({type.at("const"), type.at("title"), type.at("x-status"), type.at("description")});
  }
  std::map<std::string, int> status_of;
  for (const api::ProblemType& type : api::problem_types()) {
    made.push_back({type.type, type.title, type.status, type.when});
    CHECK_MESSAGE(status_of.emplace(type.type, type.status).second, type.type, " is there twice");
  }
  CHECK(said == made);

  // Every answer names its types, and each of them has the status of the answer.
  std::set<std::string> named;
  for_each_operation(document, [&](const std::string& path, const std::string& method, const json& operation) {
    for (const auto& [status, reference] : operation.at("responses").items()) {
      const bool is_error = status == "default" || std::stoi(status) >= 400;
      const json& response = resolved(document, reference);
      REQUIRE_MESSAGE(response.contains("x-problem-types") == is_error, method, " ", path, " ", status);
      if (!is_error) continue;
      for (const std::string type : response.at("x-problem-types")) {
        named.insert(type);
        REQUIRE_MESSAGE(status_of.count(type) == 1, type);
        if (status != "default") CHECK_MESSAGE(std::stoi(status) == status_of.at(type), path, " ", type);
      }
    }
  });
  for (const auto& [type, status] : status_of) CHECK_MESSAGE(named.count(type) == 1, "no call is answered with ", type);
}

TEST_CASE("the document and the table of routes say the same") {
  const TestServer server;
  const json document = document_of(server);
  std::set<std::pair<std::string, std::string>> answered;
  for (const http::Route& route : server.routes()) {
    const std::string method = http::lower_case(route.method);
    const bool is_said = document.at("paths").contains(route.path) && document["paths"][route.path].contains(method);
    // What the page loads is no part of the interface, and nothing of it is where the interface is.
    const bool is_file_of_page = route.name == "assets" && !route.path.starts_with("/v1/");
    CHECK_MESSAGE((is_said || is_file_of_page), route.method, " ", route.path, " is not in the document");
    if (!is_said) continue;
    CHECK_MESSAGE(answered.emplace(route.path, method).second, route.method, " ", route.path, " is there twice");
    const json& operation = document["paths"][route.path][method];
    CHECK_MESSAGE(operation.value("security", document.at("security")) == security_of(route), route.path);
    CHECK_MESSAGE(operation.contains("requestBody") == (route.body == http::Body::json), route.path);
    const std::set<std::string> parameters(route.parameters.begin(), route.parameters.end());
    CHECK_MESSAGE(parameters_in(document, operation, "query") == parameters, route.path);
    for (const std::string& name : parameters_in(document, operation, "header")) {
      const bool is_known = std::ranges::any_of(http::field_rules, [&](const auto& rule) { return rule.name == name; });
      CHECK_MESSAGE(is_known, name, " reads as absent");
    }
  }
  for_each_operation(document, [&](const std::string& path, const std::string& method, const json&) {
    CHECK_MESSAGE(answered.count({path, method}) == 1, method, " ", path, " is in the document only");
  });
}
