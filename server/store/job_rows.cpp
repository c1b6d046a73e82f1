#include "server/store/job_rows.h"

namespace penumbra::store {

namespace {

std::string text(const Query& row, Column column) { return row.text(static_cast<int>(column)); }
std::int64_t integer(const Query& row, Column column) { return row.integer(static_cast<int>(column)); }
bool is_null(const Query& row, Column column) { return row.is_null(static_cast<int>(column)); }

Time time_of(std::int64_t nanoseconds) {
  return Time(std::chrono::duration_cast<Time::duration>(std::chrono::nanoseconds(nanoseconds)));
}

std::optional<Time> optional_time(const Query& row, Column column) {
  if (is_null(row, column)) return std::nullopt;
  return time_of(integer(row, column));
}

std::optional<std::int64_t> number_of(const std::optional<Time>& time) {
  if (!time) return std::nullopt;
  return store::number_of(*time);
}

}  // namespace

JobRecord job_of(const Query& row) {
  const std::int64_t state = integer(row, Column::state);
  JobRecord job;
  job.id = text(row, Column::id);
  if (state < number_of(JobState::queued) || state > number_of(JobState::canceled))
    throw std::runtime_error("the record of job " + job.id + " is damaged");
  job.owner = text(row, Column::owner);
  job.state = static_cast<JobState>(state);
  job.priority = static_cast<int>(integer(row, Column::priority));
  job.progress_interval_s = row.real(static_cast<int>(Column::progress_interval_s));
  job.percent = row.real(static_cast<int>(Column::percent));
  job.crashes = static_cast<int>(integer(row, Column::crashes));
  job.created_at = time_of(integer(row, Column::created_at));
  job.started_at = optional_time(row, Column::started_at);
  job.finished_at = optional_time(row, Column::finished_at);
  if (!is_null(row, Column::error)) job.error = unpacked_problem(text(row, Column::error));
  if (!is_null(row, Column::stats)) job.stats = unpacked_stats(text(row, Column::stats));
  job.spec_hash = text(row, Column::spec_hash);
  job.name = text(row, Column::name);
  job.is_awaited = integer(row, Column::is_awaited) != 0;
  if (!is_null(row, Column::width)) {
    job.shape =
        api::ImageShape{static_cast<int>(integer(row, Column::width)), static_cast<int>(integer(row, Column::height)),
                        static_cast<scene::ImageFormat>(integer(row, Column::format))};
  }
  if (!is_null(row, Column::size_bytes)) job.size_bytes = static_cast<std::uint64_t>(integer(row, Column::size_bytes));
  return job;
}

void insert(Database& database, const JobRecord& job, const std::optional<std::string>& image, std::size_t spec_bytes) {
  const std::optional<std::string> error = packed_if_any(job.error), stats = packed_if_any(job.stats);
  std::optional<int> width, height, format;
  if (job.shape) {
    width = job.shape->width, height = job.shape->height;
    format = static_cast<int>(job.shape->format);
  }
  database.query("INSERT INTO jobs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)")
      .with(job.id, job.owner, number_of(job.state), job.priority, job.progress_interval_s, job.percent, job.crashes,
            number_of(job.created_at), number_of(job.started_at), number_of(job.finished_at), error, stats,
            job.spec_hash, image, job.name, width, height, format, job.size_bytes, spec_bytes, job.is_awaited ? 1 : 0)
      .run();
}

Time not_before_others(Database& database, Time end) {
  Query last = database.query("SELECT max(finished_at) FROM jobs WHERE state > 1");
  return last.next() && !last.is_null(0) ? std::max(end, time_of(last.integer(0))) : end;
}

}  // namespace penumbra::store
