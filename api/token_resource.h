#pragma once
#include <chrono>
#include <string>

#include "api/job_resource.h"

namespace penumbra::api {

/// A token for addresses (`POST /v1/tokens`), its members named as in RFC 6749, section 5.1.
struct TokenResource {
  std::string access_token;
  std::chrono::seconds expires_in;
  Time expires_at;
};

std::string to_json(const TokenResource& token);

}  // namespace penumbra::api
