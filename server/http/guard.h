#pragma once
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/access/key_ring.h"
#include "server/access/rate_limiter.h"
#include "server/access/tokens.h"
#include "server/http/exchange.h"
#include "server/http/host.h"
#include "server/http/router.h"

namespace penumbra::http {

struct GuardSettings {
  const access::KeyRing* keys = nullptr;  // none: no keys are asked for
  int requests_per_minute = 6000;         // of a key; 0: any number
  std::optional<std::size_t> max_jobs;    // unfinished ones of an owner
  std::vector<std::string> origins;       // of pages that may call from a browser; * is every one
  std::optional<KnownHosts> hosts;        // that requests may be for; none: any
};

/// What a request says of who sends it.
struct Credentials {
  std::optional<std::string_view> authorization;  // the field (RFC 6750)
  std::optional<std::string_view> token;          // access_token of the address
};

/// Decides who may call what: keys, scopes, rates, other owners' jobs, other sites' pages. May be shared between
/// threads.
class Guard {
 public:
  /// `owner_of` tells whose a job is.
  Guard(GuardSettings settings, std::function<std::optional<std::string>(const std::string& id)> owner_of);

  /// The 421 for a request that is for somebody else.
  std::optional<Response> refusal_of_host(const Exchange& exchange) const;
  /// Identifies and counts the caller, and notes both in `exchange`: nothing when the call may go on, else the answer.
  /// `id` is that of the job, empty when the route has none.
  std::optional<Response> admit(const Route& route, const std::string& id, const Credentials& credentials,
                                Exchange& exchange);
  /// Whether the key of an admitted caller is still one.
  bool still_knows(const access::Caller& caller) const;
  /// What a browser may put into addresses instead of this caller's key, to read what its owner has.
  std::string token_for(const access::Caller& caller) const;

  /// The allowed origin that equals `origin`, or *; empty when there is none.
  std::string allowed_origin(std::string_view origin) const;
  /// What every answer to this request carries: request id, rates, CORS (Fetch standard, 3.2).
  Fields fields_for(const Exchange& exchange) const;
  /// Those of the answer to a browser that asks before it calls.
  Fields preflight_fields(const std::string& methods) const;

 private:
  /// Who calls `route`; or the 401 or 403.
  std::variant<access::Caller, Response> identify(const Route& route, const Credentials& credentials) const;

  const GuardSettings settings_;
  const std::function<std::optional<std::string>(const std::string&)> owner_of_;
  access::RateLimiter rates_;
  const access::Tokens tokens_;
};

}  // namespace penumbra::http
