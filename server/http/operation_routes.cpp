#include "api/problems.h"
#include "api/version.h"
#include "server/http/routes.h"

namespace penumbra::http {

namespace {

constexpr int ready_retry_s = 5;

Response plain_text(std::string text, std::string media_type = "text/plain; charset=utf-8") {
  return {200, std::move(media_type), std::move(text), {{"Cache-Control", "no-store"}}};
}

}  // namespace

void add_operation_routes(Router& router, const jobs::JobManager& manager, const metrics::Metrics& metrics) {
  router.add({"GET", "/healthz", Body::none,
              [](const Request&) { return plain_text("ok\n" + api::program_name() + "\n"); }, std::nullopt});
  router.add({"GET", "/readyz", Body::none,
              [&](const Request&) {
                if (manager.is_accepting()) return plain_text("ok\n");
                return problem_response(api::unavailable("the server is stopping"), ready_retry_s);
              },
              std::nullopt});
  router.add({"GET", "/metrics", Body::none,
              [&](const Request&) {
                return plain_text(metrics.text(manager.counts()), "text/plain; version=0.0.4; charset=utf-8");
              },
              access::Scope::metrics});
}

}  // namespace penumbra::http
