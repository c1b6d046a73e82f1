#include "server/http/guard.h"

#include <algorithm>

#include "api/problems.h"

namespace penumbra::http {

namespace {

constexpr std::string_view challenge = "Bearer realm=\"penumbra\"";
constexpr int per_minute_s = 60;

Response with_challenge(const api::Problem& problem, const std::string& parameters = "") {
  Response response = problem_response(problem);
  response.headers.emplace_back("WWW-Authenticate", std::string(challenge) + parameters);
  return response;
}

/// The key in an Authorization field; nothing when it has another scheme.
std::optional<std::string_view> bearer_of(std::string_view authorization) {
  constexpr std::string_view scheme = "bearer ";
  if (lower_case(authorization.substr(0, scheme.size())) != scheme) return std::nullopt;
  return trimmed(authorization.substr(scheme.size()));
}

}  // namespace

Guard::Guard(GuardSettings settings, std::function<std::optional<std::string>(const std::string&)> owner_of)
    : settings_(std::move(settings)), owner_of_(std::move(owner_of)) {}

std::variant<access::Caller, Response> Guard::identify(const Route& route, const Credentials& credentials) const {
  if (settings_.keys == nullptr || !route.scope) return access::Caller{};
  const std::optional<std::string_view> text = bearer_of(credentials.authorization.value_or(""));
  const bool is_by_token = !text && route.takes_token && credentials.token;
  if (!text && !is_by_token) return with_challenge(api::key_required());
  std::shared_ptr<const access::Key> key;
  if (text) {
    key = settings_.keys->find(*text);
  } else if (const auto id = tokens_.key_id_of(*credentials.token, access::Tokens::Clock::now())) {
    key = settings_.keys->find_id(*id);
  }
  if (!key) return with_challenge(api::key_unknown(), ", error=\"invalid_token\"");
  if (!key->may(*route.scope)) {
    const std::string scope(access::name_of(*route.scope));
    return with_challenge(api::scope_missing(scope), ", error=\"insufficient_scope\", scope=\"" + scope + "\"");
  }
  const std::optional<std::size_t> max_jobs = key->max_jobs ? key->max_jobs : settings_.max_jobs;
  return access::Caller{key->id, key->owner, !is_by_token && key->may(access::Scope::admin), max_jobs,
                        key->requests_per_minute.value_or(settings_.requests_per_minute)};
}

std::optional<Response> Guard::admit(const Route& route, const std::string& id, const Credentials& credentials,
                                     Exchange& exchange) {
  auto identified = identify(route, credentials);
  if (auto* refusal = std::get_if<Response>(&identified)) return std::move(*refusal);
  exchange.caller = std::move(std::get<access::Caller>(identified));
  const access::Caller& caller = exchange.caller;
  if (!caller.key_id.empty() && caller.requests_per_minute > 0) {
    exchange.rate = rates_.take(caller.key_id, caller.requests_per_minute, access::RateLimiter::Clock::now());
    if (!exchange.rate->is_within)
      return problem_response(api::too_many_requests(caller.requests_per_minute), exchange.rate->retry_after_s);
  }
  if (!id.empty() && !caller.is_everybody && owner_of_(id) != caller.owner) return problem_response(api::no_such_job());
  return std::nullopt;
}

std::optional<Response> Guard::refusal_of_host(const Exchange& exchange) const {
  // Before HTTP/1.1 a request need not say whom it is for, and no browser sends such.
  const std::string& host = exchange.head.host;
  if (!settings_.hosts || host.empty() || settings_.hosts->has(host)) return std::nullopt;
  return problem_response(api::misdirected());
}

bool Guard::still_knows(const access::Caller& caller) const {
  return settings_.keys == nullptr || caller.key_id.empty() || settings_.keys->find_id(caller.key_id) != nullptr;
}

std::string Guard::token_for(const access::Caller& caller) const {
  return tokens_.make(caller.key_id, access::Tokens::Clock::now());
}

std::string Guard::allowed_origin(std::string_view origin) const {
  for (const std::string& allowed : settings_.origins) {
    if (allowed == "*" || allowed == origin) return allowed;
  }
  return "";
}

Fields Guard::fields_for(const Exchange& exchange) const {
  Fields fields{{"X-Request-Id", exchange.request_id}};
  if (exchange.rate) {
    // draft-ietf-httpapi-ratelimit-headers-10: structured lists (RFC 9651) of named policies.
    const access::Rate& rate = *exchange.rate;
    std::string policy = "\"requests\";q=" + std::to_string(rate.per_minute) + ";w=" + std::to_string(per_minute_s);
    if (exchange.caller.max_jobs) policy += ", \"jobs\";q=" + std::to_string(*exchange.caller.max_jobs);
    fields.emplace_back("RateLimit-Policy", policy);
    fields.emplace_back("RateLimit",
                        "\"requests\";r=" + std::to_string(rate.remaining) + ";t=" + std::to_string(rate.reset_s));
  }
  if (settings_.origins.empty()) return fields;
  fields.emplace_back("Vary", "Origin");
  if (exchange.origin.empty()) return fields;
  fields.emplace_back("Access-Control-Allow-Origin", exchange.origin);
  fields.emplace_back("Access-Control-Expose-Headers",
                      "Location, Content-Location, ETag, Retry-After, RateLimit, RateLimit-Policy, X-Job-Id, "
                      "X-Request-Id, WWW-Authenticate");
  return fields;
}

Fields Guard::preflight_fields(const std::string& methods) const {
  return {{"Access-Control-Allow-Methods", methods},
          {"Access-Control-Allow-Headers", fields_of_pages()},
          {"Access-Control-Max-Age", "600"}};
}

}  // namespace penumbra::http
