#include "server/metrics/process.h"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

namespace penumbra::metrics {

namespace {

/// When this file's variables were made: a moment after the process.
const auto started = std::chrono::system_clock::now();

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

}  // namespace

std::optional<Process> this_process() {
  std::ifstream statm("/proc/self/statm");
  long total_pages = 0, resident_pages = 0;
  if (!(statm >> total_pages >> resident_pages)) return std::nullopt;
  Process process;
  process.resident_bytes = static_cast<double>(resident_pages) * static_cast<double>(sysconf(_SC_PAGESIZE));
  process.start_time_s = std::chrono::duration<double>(started.time_since_epoch()).count();
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0) process.cpu_s = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) process.max_descriptors = static_cast<double>(limit.rlim_cur);
  std::error_code error;
  const std::filesystem::directory_iterator descriptors("/proc/self/fd", error);
  // One of them is the directory that is being read.
  if (!error) process.open_descriptors = static_cast<double>(std::distance(begin(descriptors), end(descriptors)) - 1);
  return process;
}

}  // namespace penumbra::metrics
