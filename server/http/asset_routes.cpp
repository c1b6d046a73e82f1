#include "server/http/assets.h"
#include "server/http/routes.h"

namespace penumbra::http {

namespace {

/// The page may load from this server alone, and show pictures it was given as data.
constexpr const char* content_security_policy =
    "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'none'";

Response asset_response(const Request& request, const Asset& asset) {
  const std::string tag = entity_tag(asset.sha256);
  Response response{200, std::string(asset.media_type), asset.bytes, {{"ETag", tag}, {"Cache-Control", "no-cache"}}};
  if (asset.media_type.starts_with("text/html")) {
    response.headers.emplace_back("Content-Security-Policy", content_security_policy);
    response.headers.emplace_back("Referrer-Policy", "no-referrer");
  }
  if (names_tag(request.fields, tag)) {
    response.status = 304;
    response.media_type.clear();
    response.body = std::string();
  }
  return response;
}

}  // namespace

void add_asset_routes(Router& router) {
  for (const Asset& asset : assets()) {
    Route route{"GET",        std::string(asset.path),
                Body::none,   [&asset](const Request& r) { return asset_response(r, asset); },
                std::nullopt, "assets"};
    // Addresses of pages are passed on with all sorts of things added.
    route.takes_any_parameter = !asset.path.starts_with("/v1/");
    router.add(std::move(route));
  }
}

}  // namespace penumbra::http
