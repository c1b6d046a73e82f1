#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/description.h"
#include "engine/scene/options.h"

namespace penumbra::api {

/// What a body may ask for; clients cannot raise it.
struct Limits {
  std::size_t max_body_bytes = 8u << 20;
  int max_json_depth = 64;
  std::size_t max_json_values = 1'000'000;  // elements of arrays of numbers not counted
  std::size_t max_string_bytes = 65'536;    // of each string
  std::size_t max_lights = 10'000;
  std::size_t max_primitives = 100'000;      // objects other than mesh triangles, instances and groups included
  std::size_t max_polygon_vertices = 1'000;  // of each polygon
  std::size_t max_triangles = 2'000'000;     // of meshes, each shared mesh counted once
  int max_edge_pixels = 16'384;              // of width and of height
  std::int64_t max_pixels = 16'777'216;
  int max_samples = 4'096;  // of samples_per_pixel and of shadow_samples, each
  int max_depth = 32;
  double max_work = 4e12;                     // predicted: see CostEstimate::work
  std::size_t max_memory_bytes = 4ull << 30;  // predicted: see CostEstimate::memory_bytes
};

/// What a POST body says, checked: every value obeys the contract and the limits.
struct JobRequest {
  scene::Description scene;
  scene::Options options;
};

/// As much as a core may do in one.
inline constexpr double work_of_a_second = 1e8;

/// Predicted before anything is rendered.
struct CostEstimate {
  std::size_t primitives = 0, triangles = 0, lights = 0;
  std::int64_t pixels = 0;
  // pixels · samples_per_pixel · (1 + Σ samples of each light) · rays a camera ray can become; with a target_error the
  // least that takes; no more than a time_budget_s allows: that of its first pass or, if more, work_of_a_second each
  double work = 0;
  std::size_t memory_bytes = 0;  // scene, acceleration structure and film
};

/// Reads `{"scene": …, "options": …}` (contract sections 1 and 3). Throws InvalidBody with every error found, up to
/// 100.
JobRequest parse_job(std::string_view body, const Limits& limits = {});

/// As parse_job, after setting options: `overrides` are "width=400" pairs of an option's name and its JSON value; a
/// value that is not JSON counts as a string. A bad override is an InvalidBody with pointer /options/NAME.
JobRequest parse_job(std::string_view body, const std::vector<std::string>& overrides, const Limits& limits = {});

CostEstimate estimate_cost(const JobRequest& request);

/// `{"valid": true, "cost": {…}}`: the answer to validate_only and of `penumbra validate`.
std::string to_json(const CostEstimate& cost);

}  // namespace penumbra::api
