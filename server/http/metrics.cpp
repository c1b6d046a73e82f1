#include "server/http/metrics.h"

#include <cstdio>
#include <string_view>

namespace penumbra::http {

namespace {

void describe(std::string& text, std::string_view name, std::string_view type, std::string_view help) {
  text.append("# HELP ").append(name).append(" ").append(help).append("\n# TYPE ").append(name).append(" ");
  text.append(type).append("\n");
}

void sample(std::string& text, std::string_view name, std::string_view labels, double value) {
  char number[32];
  std::snprintf(number, sizeof number, "%.17g", value);
  text.append(name).append(labels).append(" ").append(number).append("\n");
}

void metric(std::string& text, std::string_view name, std::string_view type, std::string_view help, double value) {
  describe(text, name, type, help);
  sample(text, name, "", value);
}

}  // namespace

void Metrics::count_response(int status) {
  const std::lock_guard lock(mutex_);
  ++responses_[status];
}

void Metrics::connections_changed(int by) {
  const std::lock_guard lock(mutex_);
  connections_ += by;
}

void Metrics::event_streams_changed(int by) {
  const std::lock_guard lock(mutex_);
  event_streams_ += by;
}

std::string Metrics::text(const jobs::Counts& jobs) const {
  std::string text;
  describe(text, "penumbra_build_info", "gauge", "Always 1.");
  sample(text, "penumbra_build_info", "{version=\"" PENUMBRA_VERSION "\"}", 1);
  metric(text, "penumbra_jobs_queued", "gauge", "Jobs that wait.", static_cast<double>(jobs.queued));
  metric(text, "penumbra_jobs_running", "gauge", "Jobs that render.", static_cast<double>(jobs.running));
  metric(text, "penumbra_jobs_accepted_total", "counter", "Jobs taken.", static_cast<double>(jobs.accepted));
  metric(text, "penumbra_jobs_refused_total", "counter", "Jobs refused because the queue was full.",
         static_cast<double>(jobs.refused));
  describe(text, "penumbra_jobs_ended_total", "counter", "Jobs ended, by their last state.");
  sample(text, "penumbra_jobs_ended_total", "{state=\"succeeded\"}", static_cast<double>(jobs.succeeded));
  sample(text, "penumbra_jobs_ended_total", "{state=\"failed\"}", static_cast<double>(jobs.failed));
  sample(text, "penumbra_jobs_ended_total", "{state=\"canceled\"}", static_cast<double>(jobs.canceled));
  metric(text, "penumbra_render_seconds_total", "counter", "Time spent rendering jobs that succeeded.", jobs.render_s);

  const std::lock_guard lock(mutex_);
  metric(text, "penumbra_http_connections", "gauge", "Open connections.", static_cast<double>(connections_));
  metric(text, "penumbra_http_event_streams", "gauge", "Open event streams.", static_cast<double>(event_streams_));
  describe(text, "penumbra_http_responses_total", "counter", "Responses, by status.");
  for (const auto& [status, count] : responses_)
    sample(text, "penumbra_http_responses_total", "{code=\"" + std::to_string(status) + "\"}",
           static_cast<double>(count));
  return text;
}

}  // namespace penumbra::http
