#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "api/job_request.h"
#include "engine/render/compile.h"
#include "engine/system/pool.h"

namespace penumbra::bench {

/// Reads a POST body, whatever its size.
api::JobRequest load_job(const std::string& path);

/// Calls task(first, last) for consecutive pieces of 0 … count − 1 on `threads` threads, and returns the seconds it
/// took.
double timed_in_pieces(std::size_t count, int threads, const std::function<void(std::size_t, std::size_t)>& task);

/// Seconds `work` takes.
double timed(const std::function<void()>& work);

/// Penumbra's compiled scene, built on `pool`.
render::Compiled compile_with(const scene::Description& description, system::Pool& pool);

double median(std::vector<double> values);

/// "median (least–most)".
std::string spread(const std::vector<double>& values, const char* format = "%.2f");

/// The largest resident set of this process so far, in bytes.
std::uint64_t peak_resident_bytes();

}  // namespace penumbra::bench
