#include "api/token_resource.h"

#include <nlohmann/json.hpp>

namespace penumbra::api {

std::string to_json(const TokenResource& token) {
  return nlohmann::ordered_json({{"access_token", token.access_token},
                                 {"token_type", "Bearer"},
                                 {"expires_in", token.expires_in.count()},
                                 {"expires_at", rfc3339(token.expires_at)}})
      .dump();
}

}  // namespace penumbra::api
