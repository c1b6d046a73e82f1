#include "api/token_resource.h"
#include "server/http/routes.h"

namespace penumbra::http {

void add_token_route(Router& router, const Guard& guard) {
  const auto handler = [&guard](const Request& request) {
    const auto lifetime = access::Tokens::lifetime;
    return json_response(201, api::to_json(api::TokenResource{guard.token_for(request.caller), lifetime,
                                                              std::chrono::system_clock::now() + lifetime}));
  };
  router.add({"POST", "/v1/tokens", Body::none, handler, access::Scope::read});
}

}  // namespace penumbra::http
