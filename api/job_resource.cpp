#include "api/job_resource.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "api/job_request.h"

namespace penumbra::api {

namespace {

using nlohmann::ordered_json;

constexpr std::array<std::string_view, 5> state_names{"queued", "running", "succeeded", "failed", "canceled"};

std::string text_of(const ordered_json& json) {
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

template <class Value, class Convert>
ordered_json or_null(const std::optional<Value>& value, const Convert& convert) {
  return value ? ordered_json(convert(*value)) : ordered_json(nullptr);
}

double rounded_down(double value, double steps_per_unit) { return std::floor(value * steps_per_unit) / steps_per_unit; }

/// Two digits, rounded down so that it cannot show 100 too early.
double shown_percent(const JobResource& job) {
  if (job.state == JobState::succeeded) return 100;
  const double percent = rounded_down(std::clamp(job.percent, 0.0, 99.99), 100);
  return std::isfinite(percent) ? percent : 0;
}

ordered_json shown_eta(const JobResource& job) {
  return or_null(job.eta_s, [](double seconds) { return rounded_down(seconds, 1000); });
}

ordered_json object_of(const render::Stats& stats) {
  // A member more, and this no longer compiles.
  const auto& [build_s, render_s, encode_s, rays, skipped, estimated_error] = stats;
  ordered_json rays_by_name = ordered_json::object(), skipped_by_name = ordered_json::object();
  for (const auto& [name, count] : shading::by_name_of_ray(rays)) rays_by_name[name] = *count;
  for (const auto& [name, count] : skipped) skipped_by_name[name] = count;
  return {{"build_s", build_s},
          {"render_s", render_s},
          {"encode_s", encode_s},
          {"rays", std::move(rays_by_name)},
          {"skipped", std::move(skipped_by_name)},
          {"estimated_error", estimated_error}};
}

std::string_view name_of(scene::ImageFormat format) { return format == scene::ImageFormat::png ? "png" : "exr"; }

ordered_json object_of(const JobResource& job) {
  const std::string self = "/v1/jobs/" + job.id;
  const auto parsed = [](const auto& value) { return ordered_json::parse(to_json(value), nullptr, false); };
  return {{"id", job.id},
          {"state", name_of(job.state)},
          {"progress", {{"percent", shown_percent(job)}, {"eta_s", shown_eta(job)}}},
          {"queue_position", or_null(job.queue_position, [](std::int64_t position) { return position; })},
          {"created_at", rfc3339(job.created_at)},
          {"started_at", or_null(job.started_at, rfc3339)},
          {"finished_at", or_null(job.finished_at, rfc3339)},
          {"error", or_null(job.error, parsed)},
          {"stats", or_null(job.stats, [](const render::Stats& stats) { return object_of(stats); })},
          {"name", job.name},
          {"width", or_null(job.shape, [](const ImageShape& shape) { return shape.width; })},
          {"height", or_null(job.shape, [](const ImageShape& shape) { return shape.height; })},
          {"format", or_null(job.shape, [](const ImageShape& shape) { return name_of(shape.format); })},
          {"size_bytes", or_null(job.size_bytes, [](std::uint64_t bytes) { return bytes; })},
          {"links",
           {{"self", self},
            {"events", self + "/events"},
            {"image", self + "/image"},
            {"preview", self + "/preview"},
            {"thumbnail", self + "/thumbnail"},
            {"scene", self + "/scene"},
            {"cancel", self + "/cancel"}}}};
}

}  // namespace

std::string_view name_of(JobState state) { return state_names[static_cast<std::size_t>(state)]; }

std::optional<JobState> job_state_of(std::string_view name) {
  const auto* const found = std::find(state_names.begin(), state_names.end(), name);
  if (found == state_names.end()) return std::nullopt;
  return static_cast<JobState>(found - state_names.begin());
}

std::string rfc3339(Time time) {
  using namespace std::chrono;
  const auto instant = floor<milliseconds>(time);
  const auto day = floor<days>(instant);
  const year_month_day date(day);
  const hh_mm_ss clock(instant - day);
  std::array<char, 64> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%04d-%02u-%02uT%02d:%02d:%02d.%03dZ", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                static_cast<int>(clock.hours().count()), static_cast<int>(clock.minutes().count()),
                static_cast<int>(clock.seconds().count()), static_cast<int>(clock.subseconds().count()));
  return buffer.data();
}

std::string to_json(const JobResource& job) { return text_of(object_of(job)); }

std::string to_json(const std::vector<JobResource>& jobs, const std::optional<std::string>& next_page_token) {
  ordered_json list = ordered_json::array();
  for (const JobResource& job : jobs) list.push_back(object_of(job));
  return text_of({{"jobs", std::move(list)},
                  {"next_page_token", or_null(next_page_token, [](const std::string& token) { return token; })}});
}

std::string progress_json(const JobResource& job) {
  return text_of({{"percent", shown_percent(job)}, {"eta_s", shown_eta(job)}, {"state", name_of(job.state)}});
}

std::string to_json(const render::Stats& stats) { return text_of(object_of(stats)); }

std::string to_json(const CostEstimate& cost) {
  return text_of({{"valid", true},
                  {"cost",
                   {{"primitives", cost.primitives},
                    {"triangles", cost.triangles},
                    {"lights", cost.lights},
                    {"pixels", cost.pixels},
                    {"work", cost.work},
                    {"memory_bytes", cost.memory_bytes}}}});
}

}  // namespace penumbra::api
