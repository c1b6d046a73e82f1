// Bodies of jobs: whatever the bytes, parse_job returns or throws InvalidBody, and says why in valid JSON.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "api/job_request.h"
#include "api/json_reader.h"
#include "api/problem.h"

namespace {

/// Small enough that no run takes long.
penumbra::api::Limits limits() {
  penumbra::api::Limits limits;
  limits.max_body_bytes = 1u << 16;
  limits.max_polygon_vertices = 64;
  return limits;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace penumbra::api;
  const std::string_view body(reinterpret_cast<const char*>(data), size);
  try {
    const JobRequest request = parse_job(body, limits());
    if (!(estimate_cost(request).work >= 0)) std::abort();
  } catch (const InvalidBody& invalid) {
    const Problem& problem = invalid.problem();
    if (problem.status != 400 && problem.status != 413 && problem.status != 422) std::abort();
    if (problem.detail.empty() || problem.errors.size() > max_field_errors) std::abort();
    read_json(to_json(problem));
  }
  return 0;
}
