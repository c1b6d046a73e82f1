#include "server/http/server.h"

namespace penumbra::http {

namespace {

GuardSettings guard_of_admin(const ServerSettings& settings) {
  GuardSettings guard;
  guard.hosts = settings.admin_hosts;
  return guard;
}

}  // namespace

Server::Server(const ServerSettings& settings, jobs::JobManager& manager, metrics::Metrics& metrics)
    : log_(settings.access_log),
      guard_(settings.guard, [&manager](const std::string& id) { return manager.owner_of(id); }),
      admin_guard_(guard_of_admin(settings), [](const std::string&) { return std::nullopt; }) {
  add_job_routes(router_, manager);
  add_event_route(router_, manager, metrics, settings.streams);
  add_render_route(router_, manager);
  add_token_route(router_, guard_);
  add_operation_routes(router_, manager, metrics);
  add_asset_routes(router_);
  listener_ = std::make_unique<Listener>(settings.listener, router_, guard_, metrics, log_);
  if (!settings.admin) return;
  add_operation_routes(admin_router_, manager, metrics);
  admin_ = std::make_unique<Listener>(*settings.admin, admin_router_, admin_guard_, metrics, log_);
}

Server::~Server() = default;

Server::Ports Server::start() {
  Ports ports;
  if (admin_) ports.admin = admin_->open();
  ports.main = listener_->open();
  return ports;
}

void Server::stop() {
  listener_->finish();
  if (admin_) admin_->finish();
}

}  // namespace penumbra::http
