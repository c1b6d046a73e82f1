#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/problem.h"
#include "engine/render/stats.h"
#include "engine/scene/options.h"

namespace penumbra::api {

using Time = std::chrono::system_clock::time_point;

enum class JobState { queued, running, succeeded, failed, canceled };

inline bool is_final(JobState state) { return state != JobState::queued && state != JobState::running; }
std::string_view name_of(JobState state);
std::optional<JobState> job_state_of(std::string_view name);

/// What the image of a job is or will be.
struct ImageShape {
  int width = 0, height = 0;  // pixels
  scene::ImageFormat format = scene::ImageFormat::png;
};

/// The job as clients see it (contract section 4); links follow from the id.
struct JobResource {
  std::string id;
  JobState state = JobState::queued;
  double percent = 0;  // 0 to 100, 100 only in succeeded
  std::optional<double> eta_s;
  std::optional<std::int64_t> queue_position;  // 1 = next; only while queued
  Time created_at;
  std::optional<Time> started_at, finished_at;
  std::optional<Problem> error;  // only in failed
  std::optional<render::Stats> stats;
  std::string name;                         // of the scene
  std::optional<ImageShape> shape;          // nothing where an earlier version has not noted it
  std::optional<std::uint64_t> size_bytes;  // of the image; only while it is kept
};

/// RFC 3339 in UTC with milliseconds: 2026-11-24T10:00:00.123Z
std::string rfc3339(Time time);

/// Every key of the contract is present; what is not known is null.
std::string to_json(const JobResource& job);
/// `{"jobs": […], "next_page_token": "…" | null}`
std::string to_json(const std::vector<JobResource>& jobs, const std::optional<std::string>& next_page_token);
/// `{"percent", "eta_s", "state"}`: the data of a progress event, on one line.
std::string progress_json(const JobResource& job);
/// The `stats` object alone.
std::string to_json(const render::Stats& stats);

}  // namespace penumbra::api
