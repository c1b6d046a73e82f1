#include "server/http/guard.h"

#include <algorithm>

#include "server/http/problems.h"

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

std::variant<access::Caller, Response> Guard::identify(const Route& route,
                                                       std::optional<std::string_view> authorization) const {
  if (settings_.keys == nullptr || !route.scope) return access::Caller{};
  const std::optional<std::string_view> text = bearer_of(authorization.value_or(""));
  if (!text) return with_challenge(key_required());
  const std::shared_ptr<const access::Key> key = settings_.keys->find(*text);
  if (!key) return with_challenge(key_unknown(), ", error=\"invalid_token\"");
  if (!key->may(*route.scope)) {
    const std::string scope(access::name_of(*route.scope));
    return with_challenge(scope_missing(scope), ", error=\"insufficient_scope\", scope=\"" + scope + "\"");
  }
  const std::optional<std::size_t> max_jobs = key->max_jobs ? key->max_jobs : settings_.max_jobs;
  return access::Caller{key->id, key->owner, key->may(access::Scope::admin), max_jobs,
                        key->requests_per_minute.value_or(settings_.requests_per_minute)};
}

std::optional<Response> Guard::admit(const Route& route, const std::string& id,
                                     std::optional<std::string_view> authorization, Exchange& exchange) {
  auto identified = identify(route, authorization);
  if (auto* refusal = std::get_if<Response>(&identified)) return std::move(*refusal);
  exchange.caller = std::move(std::get<access::Caller>(identified));
  const access::Caller& caller = exchange.caller;
  if (!caller.key_id.empty() && caller.requests_per_minute > 0) {
    exchange.rate = rates_.take(caller.key_id, caller.requests_per_minute, access::RateLimiter::Clock::now());
    if (!exchange.rate->is_within)
      return problem_response(too_many_requests(caller.requests_per_minute), exchange.rate->retry_after_s);
  }
  if (!id.empty() && !caller.is_everybody && owner_of_(id) != caller.owner) return problem_response(no_such_job());
  return std::nullopt;
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
          {"Access-Control-Allow-Headers",
           "Authorization, Content-Type, Idempotency-Key, If-None-Match, Last-Event-ID, X-Request-Id, traceparent"},
          {"Access-Control-Max-Age", "600"}};
}

}  // namespace penumbra::http
