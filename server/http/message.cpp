#include "server/http/message.h"

#include <algorithm>
#include <ctime>

#include "server/http/problems.h"

namespace penumbra::http {

namespace {

constexpr int stopping_retry_s = 5;

std::optional<std::string_view> value_of(const Fields& fields, std::string_view name) {
  const auto field = std::find_if(fields.begin(), fields.end(), [&](const auto& f) { return f.first == name; });
  if (field == fields.end()) return std::nullopt;
  return field->second;
}

}  // namespace

std::optional<std::string_view> Request::header(std::string_view lower_case_name) const {
  return value_of(headers, lower_case_name);
}

std::optional<std::string_view> Request::parameter(std::string_view name) const { return value_of(query, name); }

Response json_response(int status, std::string json) {
  return {status, "application/json", std::move(json), {{"Cache-Control", "no-store"}}};
}

Response problem_response(const api::Problem& problem) {
  return {problem.status, "application/problem+json", api::to_json(problem), {{"Cache-Control", "no-store"}}};
}

Response problem_response(const api::Problem& problem, int retry_after_s) {
  Response response = problem_response(problem);
  response.headers.emplace_back("Retry-After", std::to_string(retry_after_s));
  return response;
}

Response stopping_response() { return problem_response(unavailable("the server is stopping"), stopping_retry_s); }

std::string http_date() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[64];
  return {text, std::strftime(text, sizeof text, "%a, %d %b %Y %H:%M:%S GMT", &utc)};
}

std::string entity_tag(std::string_view sha256) { return std::string(1, '"').append(sha256).append(1, '"'); }

bool names_tag(std::string_view if_none_match, std::string_view tag) {
  while (!if_none_match.empty()) {
    const std::size_t comma = if_none_match.find(',');
    std::string_view candidate = trimmed(if_none_match.substr(0, comma));
    if (candidate.starts_with("W/")) candidate.remove_prefix(2);
    if (candidate == tag || candidate == "*") return true;
    if (comma == std::string_view::npos) return false;
    if_none_match.remove_prefix(comma + 1);
  }
  return false;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace penumbra::http
