#pragma once
#include <memory>
#include <optional>

#include "server/http/exchange.h"
#include "server/log/log.h"

namespace spdlog {
class logger;
}

namespace penumbra::http {

/// A line of the log for each request. May be shared between threads.
class AccessLog {
 public:
  /// Nothing: no lines.
  explicit AccessLog(std::optional<log::Format> format);

  void write(const Exchange& exchange) const;

 private:
  std::shared_ptr<spdlog::logger> logger_;
  log::Format format_;
};

}  // namespace penumbra::http
