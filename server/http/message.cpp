#include "server/http/message.h"

#include <algorithm>
#include <ctime>

#include "api/problems.h"
#include "server/http/encoding.h"

namespace penumbra::http {

namespace {

constexpr int stopping_retry_s = 5, overload_retry_s = 2;

}  // namespace

std::optional<std::string_view> Request::parameter(std::string_view name) const {
  const auto found = std::ranges::find(query, name, &Fields::value_type::first);
  return found == query.end() ? std::nullopt : std::optional<std::string_view>(found->second);
}

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

Response overload_response(std::string what) {
  return problem_response(api::unavailable(std::move(what)), overload_retry_s);
}

Response stopping_response() { return problem_response(api::unavailable("the server is stopping"), stopping_retry_s); }

std::string http_date() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[64];
  return {text, std::strftime(text, sizeof text, "%a, %d %b %Y %H:%M:%S GMT", &utc)};
}

std::string entity_tag(std::string_view sha256) { return std::string(1, '"').append(sha256).append(1, '"'); }

bool names_tag(const FieldValues& fields, std::string_view tag) {
  const std::string compressed = gzip_tag(tag);
  return any_member(fields[Field::if_none_match].value_or(""), [&](std::string_view member) {
    if (member.starts_with("W/")) member.remove_prefix(2);
    return member == tag || member == compressed || member == "*";
  });
}

}  // namespace penumbra::http
