#include "server/http/access_log.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cstdio>

namespace penumbra::http {

namespace {

std::string milliseconds(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", value);
  return text;
}

/// With the values of those parameters alone that are no secrets of anybody.
std::string target_for_log(std::string_view target) {
  constexpr std::array<std::string_view, 4> open_parameters{"validate_only", "state", "limit", "page_token"};
  std::size_t begin = std::min(target.find('?'), target.size());
  std::string text(target.substr(0, begin));
  while (begin < target.size()) {
    const std::size_t end = std::min(target.find('&', begin + 1), target.size());
    const std::string_view part = target.substr(begin, end - begin);
    const std::size_t sign = part.find('=');
    text += part.substr(0, sign);
    if (sign != std::string_view::npos)
      text += std::ranges::find(open_parameters, part.substr(1, sign - 1)) != open_parameters.end() ? part.substr(sign)
                                                                                                    : "=***";
    begin = end;
  }
  return text;
}

/// The members of a JSON object.
std::string members_of(const Exchange& exchange, double took_ms) {
  std::string text = "\"event\":\"request\"";
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) text.append(",\"").append(name).append("\":").append(log::quoted(value));
  };
  add("request_id", exchange.request_id);
  if (exchange.trace) {
    add("trace_id", exchange.trace->trace_id);
    add("parent_id", exchange.trace->parent_id);
  }
  add("client", exchange.client);
  add("key", exchange.caller.key_id);
  add("owner", exchange.caller.owner);
  add("method", exchange.head.method);
  add("target", target_for_log(exchange.head.target));
  add("route", exchange.route);
  text += ",\"status\":" + std::to_string(exchange.status) + ",\"bytes\":" + std::to_string(exchange.sent_bytes);
  return text + ",\"duration_ms\":" + milliseconds(took_ms);
}

std::string text_of(const Exchange& exchange, double took_ms) {
  const std::string request = log::quoted(exchange.head.method + " " + target_for_log(exchange.head.target));
  return exchange.client + " " + (exchange.caller.key_id.empty() ? "-" : exchange.caller.key_id) + " " + request + " " +
         std::to_string(exchange.status) + " " + std::to_string(exchange.sent_bytes) + " " + milliseconds(took_ms) +
         " ms " + exchange.request_id;
}

}  // namespace

AccessLog::AccessLog(std::optional<log::Format> format)
    : logger_(format ? spdlog::get(log::access_logger) : nullptr), format_(format.value_or(log::Format::json)) {}

void AccessLog::write(const Exchange& exchange) const {
  if (!logger_ || !logger_->should_log(spdlog::level::info)) return;
  const double took_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - exchange.start).count();
  logger_->info(format_ == log::Format::json ? members_of(exchange, took_ms) : text_of(exchange, took_ms));
}

}  // namespace penumbra::http
