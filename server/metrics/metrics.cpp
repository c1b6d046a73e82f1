#include "server/metrics/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <string>
#include <vector>

#include "api/version.h"
#include "server/log/log.h"
#include "server/metrics/process.h"

namespace penumbra::metrics {

namespace {

using prometheus::ClientMetric;
using prometheus::Counter;
using prometheus::Family;
using prometheus::Gauge;
using prometheus::Histogram;
using prometheus::MetricFamily;
using Buckets = Histogram::BucketBoundaries;

// Upper bounds, in seconds but for the errors.
const Buckets request_buckets{.0005, .001, .0025, .005, .01, .025, .05, .1, .25, .5, 1, 2.5, 5, 10, 30, 60, 300};
const Buckets job_buckets{.01, .025, .05, .1, .25, .5, 1, 2.5, 5, 10, 30, 60, 120, 300, 600, 1800, 3600};
const Buckets store_buckets{.00001, .00005, .0001, .00025, .0005, .001, .0025, .005, .01, .025, .05, .1, .25, .5, 1, 5};
const Buckets error_buckets{1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, .1};

/// A family whose values are known elsewhere, as they are now.
class Sampled {
 public:
  Sampled(std::string name, std::string help, prometheus::MetricType type) {
    family_.name = std::move(name);
    family_.help = std::move(help);
    family_.type = type;
  }
  Sampled& add(double value, std::vector<ClientMetric::Label> labels = {}) {
    ClientMetric metric;
    metric.label = std::move(labels);
    (family_.type == prometheus::MetricType::Counter ? metric.counter.value : metric.gauge.value) = value;
    family_.metric.push_back(std::move(metric));
    return *this;
  }
  MetricFamily done() { return std::move(family_); }

 private:
  MetricFamily family_;
};

Sampled gauge(std::string name, std::string help) {
  return {std::move(name), std::move(help), prometheus::MetricType::Gauge};
}
Sampled counter(std::string name, std::string help) {
  return {std::move(name), std::move(help), prometheus::MetricType::Counter};
}

void sample_jobs(const jobs::Counts& jobs, std::vector<MetricFamily>& families) {
  const auto number = [](auto count) { return static_cast<double>(count); };
  // A count more no longer compiles here.
  const auto& [queued, running, renders, max_queued, accepted, succeeded, failed, canceled, refused] = jobs;
  families.push_back(
      gauge("penumbra_build_info", "Always 1; the version and the hash of the engine's sources are labels.")
          .add(1, {{"engine", std::string(api::short_engine_hash())}, {"version", std::string(api::version())}})
          .done());
  families.push_back(gauge("penumbra_jobs", "Unfinished jobs, by state.")
                         .add(number(queued), {{"state", "queued"}})
                         .add(number(running), {{"state", "running"}})
                         .done());
  families.push_back(gauge("penumbra_renders", "Renders under way; equal jobs share one.").add(number(renders)).done());
  families.push_back(gauge("penumbra_queue_limit", "Jobs that may wait at most.").add(number(max_queued)).done());
  families.push_back(counter("penumbra_jobs_accepted_total", "Jobs taken.").add(number(accepted)).done());
  families.push_back(
      counter("penumbra_jobs_refused_total", "Jobs refused because a queue was full.").add(number(refused)).done());
  families.push_back(counter("penumbra_jobs_ended_total", "Jobs ended, by their last state.")
                         .add(number(succeeded), {{"state", "succeeded"}})
                         .add(number(failed), {{"state", "failed"}})
                         .add(number(canceled), {{"state", "canceled"}})
                         .done());
}

void sample_process(std::vector<MetricFamily>& families) {
  const std::optional<Process> process = this_process();
  if (!process) return;
  families.push_back(gauge("process_resident_memory_bytes", "Resident memory.").add(process->resident_bytes).done());
  families.push_back(counter("process_cpu_seconds_total", "Processor time.").add(process->cpu_s).done());
  families.push_back(gauge("process_start_time_seconds", "Since the epoch.").add(process->start_time_s).done());
  families.push_back(gauge("process_open_fds", "Open file descriptors.").add(process->open_descriptors).done());
  families.push_back(gauge("process_max_fds", "Descriptors that may be open.").add(process->max_descriptors).done());
}

}  // namespace

struct Metrics::Families {
  prometheus::Registry registry;

  Family<Counter>& requests = prometheus::BuildCounter()
                                  .Name("penumbra_http_requests_total")
                                  .Help("Requests answered, by route, method and status.")
                                  .Register(registry);
  Family<Histogram>& request_durations = prometheus::BuildHistogram()
                                             .Name("penumbra_http_request_duration_seconds")
                                             .Help("First byte of the request to last of the answer.")
                                             .Register(registry);
  Gauge& connections =
      prometheus::BuildGauge().Name("penumbra_http_connections").Help("Open connections.").Register(registry).Add({});
  Gauge& event_streams = prometheus::BuildGauge()
                             .Name("penumbra_http_event_streams")
                             .Help("Open event streams.")
                             .Register(registry)
                             .Add({});
  Histogram& queue_wait = prometheus::BuildHistogram()
                              .Name("penumbra_queue_wait_seconds")
                              .Help("Time between acceptance and start of jobs.")
                              .Register(registry)
                              .Add({}, job_buckets);
  Histogram& render = prometheus::BuildHistogram()
                          .Name("penumbra_render_seconds")
                          .Help("Time spent on each render that gave an image.")
                          .Register(registry)
                          .Add({}, job_buckets);
  Histogram& error = prometheus::BuildHistogram()
                         .Name("penumbra_estimated_error")
                         .Help("Estimated root mean square error of images, in linear light.")
                         .Register(registry)
                         .Add({}, error_buckets);
  Family<Counter>& rays = prometheus::BuildCounter()
                              .Name("penumbra_rays_total")
                              .Help("Rays of renders that gave an image, by kind.")
                              .Register(registry);
  Counter& camera = rays.Add({{"kind", "camera"}});
  Counter& shadow = rays.Add({{"kind", "shadow"}});
  Counter& reflection = rays.Add({{"kind", "reflection"}});
  Counter& transmission = rays.Add({{"kind", "transmission"}});
  Family<Histogram>& store = prometheus::BuildHistogram()
                                 .Name("penumbra_store_operation_duration_seconds")
                                 .Help("Calls of the job store, by operation.")
                                 .Register(registry);
};

Metrics::Metrics() : families_(std::make_unique<Families>()) {}

Metrics::~Metrics() = default;

void Metrics::count_request(std::string_view route, std::string_view method, int status) {
  families_->requests
      .Add({{"route", std::string(route)}, {"method", std::string(method)}, {"code", std::to_string(status)}})
      .Increment();
}

void Metrics::request_took(std::string_view route, int status, double seconds) {
  families_->request_durations.Add({{"route", std::string(route)}, {"code", std::to_string(status)}}, request_buckets)
      .Observe(seconds);
}

void Metrics::connections_changed(int by) { families_->connections.Increment(by); }

void Metrics::event_streams_changed(int by) { families_->event_streams.Increment(by); }

void Metrics::job_started(double waited_s) { families_->queue_wait.Observe(waited_s); }

void Metrics::image_rendered(const render::Stats& stats) {
  families_->render.Observe(stats.render_s);
  families_->error.Observe(stats.estimated_error);
  const auto& [camera, shadow, reflection, transmission] = stats.rays;
  families_->camera.Increment(static_cast<double>(camera));
  families_->shadow.Increment(static_cast<double>(shadow));
  families_->reflection.Increment(static_cast<double>(reflection));
  families_->transmission.Increment(static_cast<double>(transmission));
}

void Metrics::store_called(std::string_view operation, double seconds) {
  families_->store.Add({{"operation", std::string(operation)}}, store_buckets).Observe(seconds);
}

std::string Metrics::text(const jobs::Counts& jobs) const {
  std::vector<MetricFamily> families;
  sample_jobs(jobs, families);
  for (MetricFamily& family : families_->registry.Collect()) families.push_back(std::move(family));
  families.push_back(counter("penumbra_log_dropped_lines_total", "Lines of the log that nobody read in time.")
                         .add(static_cast<double>(log::dropped_lines()))
                         .done());
  sample_process(families);
  return prometheus::TextSerializer().Serialize(families);
}

}  // namespace penumbra::metrics
