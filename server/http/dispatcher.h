#pragma once
#include <cstddef>
#include <memory>

#include "server/http/connection.h"
#include "server/http/exchange.h"
#include "server/http/guard.h"
#include "server/http/router.h"
#include "server/metrics/metrics.h"

namespace penumbra::http {

/// Answers requests that have been read up to their bodies: finds the route, asks the guard, reads the body, calls the
/// handler. The HTTP library parses and writes. May be shared between threads.
class Dispatcher {
 public:
  /// All of these must outlive the dispatcher. Sizes in bytes: of one body, also when it was compressed, and of the
  /// large ones of all connections together.
  Dispatcher(const Router& router, Guard& guard, metrics::Metrics& metrics, std::size_t max_body_bytes,
             std::size_t max_held_body_bytes);
  ~Dispatcher();
  Dispatcher(const Dispatcher&) = delete;
  Dispatcher& operator=(const Dispatcher&) = delete;

  /// Answers the request that `connection` has begun and whose head is that of `exchange`. False when the answer could
  /// not be written, or ends the connection.
  bool answer(Connection& connection, Exchange& exchange);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace penumbra::http
