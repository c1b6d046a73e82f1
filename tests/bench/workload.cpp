#include "tests/bench/workload.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace penumbra::bench {
namespace {

std::string formatted(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

}  // namespace

api::JobRequest load_job(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::ostringstream text;
  text << file.rdbuf();
  api::Limits limits;
  limits.max_body_bytes = std::numeric_limits<std::size_t>::max() / 2;
  limits.max_json_values = std::numeric_limits<std::size_t>::max() / 2;
  limits.max_triangles = std::numeric_limits<std::size_t>::max() / 2;
  return api::parse_job(text.str(), limits);
}

double timed(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double timed_in_pieces(std::size_t count, int threads, const std::function<void(std::size_t, std::size_t)>& task) {
  constexpr std::size_t piece = 1024;
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t first; (first = next.fetch_add(piece)) < count;) task(first, std::min(first + piece, count));
  };
  return timed([&] {
    std::vector<std::jthread> others;
    for (int i = 1; i < threads; ++i) others.emplace_back(work);
    work();
  });
}

render::Compiled compile_with(const scene::Description& description, system::Pool& pool) {
  render::CompileSettings settings;
  settings.parallel_for = [&](std::int64_t count, const std::function<void(std::int64_t)>& task) {
    pool.run(count, pool.size(), task);
  };
  return render::compile(description, settings);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 ? values[half] : (values[half - 1] + values[half]) / 2;
}

std::string spread(const std::vector<double>& values, const char* format) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return formatted(format, median(values)) + " (" + formatted(format, *least) + "–" + formatted(format, *most) + ")";
}

std::uint64_t peak_resident_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::uint64_t kibibytes = 0;
    if (word == "VmHWM:" && status >> kibibytes) return kibibytes * 1024;
  }
  throw std::runtime_error("no VmHWM in /proc/self/status");
}

}  // namespace penumbra::bench
