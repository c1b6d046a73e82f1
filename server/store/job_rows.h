#pragma once
#include <cstdint>

#include "server/store/job_store.h"
#include "server/store/packed.h"
#include "server/store/sqlite.h"

namespace penumbra::store {

inline std::int64_t number_of(JobState state) { return static_cast<std::int64_t>(state); }
/// Nanoseconds since 1970.
inline std::int64_t number_of(Time time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

/// The columns of a row of `jobs`; the schema check makes sure of their order.
enum class Column {
  id,
  owner,
  state,
  priority,
  progress_interval_s,
  percent,
  crashes,
  created_at,
  started_at,
  finished_at,
  error,
  stats,
  spec_hash,
  image,
  name,
  width,
  height,
  format,
  size_bytes,
  spec_bytes,
  is_awaited,
  after_last
};

/// A row that `SELECT * FROM jobs` has stepped to. Throws std::runtime_error when it holds what was never written.
JobRecord job_of(const Query& row);

/// Inserts a row; `image` is the hash of the image it has, `spec_bytes` the size of its body.
void insert(Database& database, const JobRecord& job, const std::optional<std::string>& image, std::size_t spec_bytes);

/// `end`, or when the last job ended, if the clock was set back since: jobs are dropped in this order.
Time not_before_others(Database& database, Time end);

template <class Value>
std::optional<std::string> packed_if_any(const std::optional<Value>& value) {
  if (!value) return std::nullopt;
  return packed(*value);
}

}  // namespace penumbra::store
