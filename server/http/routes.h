#pragma once
#include <cstddef>

#include "server/http/guard.h"
#include "server/http/router.h"
#include "server/jobs/job_manager.h"
#include "server/metrics/metrics.h"

namespace penumbra::http {

// Each adds the routes of one part of the interface; what it is given must outlive the router.

/// /v1/jobs and /v1/jobs/{id} with cancel, image and preview.
void add_job_routes(Router& router, jobs::JobManager& manager);
/// /v1/jobs/{id}/events.
struct StreamLimits {
  std::size_t all = 512, of_one_client = 8;
};
void add_event_route(Router& router, jobs::JobManager& manager, metrics::Metrics& metrics, const StreamLimits& limits);
/// /v1/render.
void add_render_route(Router& router, jobs::JobManager& manager);
/// /healthz, /readyz, /metrics.
void add_operation_routes(Router& router, const jobs::JobManager& manager, const metrics::Metrics& metrics);
/// /v1/tokens.
void add_token_route(Router& router, const Guard& guard);
/// The web page, the example scenes and the machine-readable contract.
void add_asset_routes(Router& router);

}  // namespace penumbra::http
