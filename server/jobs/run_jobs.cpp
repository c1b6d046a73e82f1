#include <spdlog/spdlog.h>

#include <algorithm>
#include <new>

#include "engine/output/encode.h"
#include "engine/render/render.h"
#include "server/jobs/endings.h"
#include "server/jobs/job_manager.h"
#include "server/store/sha256.h"

namespace penumbra::jobs {

using std::chrono::system_clock;

void JobManager::run_jobs(const std::stop_token& stop) {
  while (true) {
    std::shared_ptr<LiveJob> job;
    {
      std::unique_lock lock(mutex_);
      if (!work_available_.wait(lock, stop, [&] { return !queue_.empty(); })) return;
      job = queue_.begin()->second;
      take_from_queue(*job);
      ++running_;
    }
    run(*job);
  }
}

void JobManager::run(LiveJob& job) {
  store::Ending ending;
  try {
    std::unique_ptr<api::JobRequest> request = job.take_request();
    if (!request) {
      request = std::make_unique<api::JobRequest>(api::parse_job(store_.spec(job.id()).value_or(""), settings_.limits));
    }
    const api::Time now = system_clock::now();
    store_.start(job.id(), now);
    job.start(now, request->options.width, request->options.height);
    spdlog::debug("job {} started", job.id());
    if (settings_.on_start) settings_.on_start(std::chrono::duration<double>(now - job.created_at()).count());
    ending = rendered(job, *request);
  } catch (const api::InvalidBody& invalid) {
    // Accepted once, but not by this version or under these limits.
    ending = failure(invalid.problem());
  } catch (const std::bad_alloc&) {
    spdlog::error("job {}: out of memory", job.id());
    ending = failure({"/problems/out-of-memory", "Out of memory", 500, "the server ran out of memory", {}});
  } catch (const std::exception& error) {
    spdlog::error("job {}: {}", job.id(), error.what());
    ending = failure({"/problems/render-failed", "The render failed", 500, "the render failed; the log says why", {}});
  }
  if (ending.state != api::JobState::succeeded) ending.percent = job.resource().percent;
  const double took_s = job.running_s();
  {
    const std::lock_guard lock(mutex_);
    --running_;
    average_s_ += (took_s - average_s_) / 8;
  }
  end(job, std::move(ending));
}

store::Ending JobManager::rendered(LiveJob& job, const api::JobRequest& request) {
  const auto stopped_here = [&]() -> std::optional<store::Ending> {
    const std::optional<StopReason> reason = job.stop_reason();
    if (!reason) return std::nullopt;
    return stopped(*reason, settings_.time_limit_s.value_or(0));
  };
  if (auto ending = stopped_here()) return *ending;
  if (request.options.format == scene::ImageFormat::exr) output::preload();
  std::optional<render::Picture> picture = render::render(request.scene, request.options, pool_, job.control);
  if (auto ending = stopped_here()) return *ending;
  if (!picture) return failure({"/problems/render-failed", "The render failed", 500, "the render gave no image", {}});

  const Clock::time_point start = Clock::now();
  const output::Encoding encoding = output::encoding_of(request.options);
  store::Image image;
  image.bytes = std::make_shared<const std::string>(output::encode(picture->film, encoding));
  image.media_type = output::media_type(encoding.format);
  picture->stats.encode_s = std::chrono::duration<double>(Clock::now() - start).count();
  image.sha256 = store::sha256_hex(*image.bytes);
  if (encoding.format != scene::ImageFormat::png)
    image.png_preview = std::make_shared<const std::string>(output::encode(picture->film, output::Encoding{}));
  // Whoever asked for a cancel was told that the job is on its way there.
  if (auto ending = stopped_here()) return *ending;

  store::Ending ending;
  ending.stats = picture->stats;
  ending.image = std::move(image);
  return ending;
}

void JobManager::end(LiveJob& job, store::Ending ending) {
  ending.finished_at = system_clock::now();
  store::Ending without_image{ending.state, ending.percent, ending.finished_at, ending.error, ending.stats, {}};
  spdlog::debug("job {} {}", job.id(), api::name_of(ending.state));
  try {
    // Stored before anyone hears of it.
    store_.finish(job.id(), std::move(ending));
    store_.expire(settings_.retention, system_clock::now());
  } catch (const std::exception& error) {
    spdlog::critical("job {}: cannot be stored: {}", job.id(), error.what());
  }
  {
    const std::lock_guard lock(mutex_);
    switch (without_image.state) {
      case api::JobState::succeeded:
        ++totals_.succeeded;
        break;
      case api::JobState::canceled:
        ++totals_.canceled;
        break;
      default:
        ++totals_.failed;
    }
    drop_live(job.id());
  }
  if (settings_.on_end) settings_.on_end(without_image);
  job.end(without_image);
}

void JobManager::keep_time(const std::stop_token& stop) {
  using std::chrono::duration_cast;
  const double tick_s = std::clamp(settings_.time_limit_s.value_or(10) / 10, 0.01, 1.0);
  const auto tick = duration_cast<Clock::duration>(std::chrono::duration<double>(tick_s));
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    if (settings_.time_limit_s) {
      for (const auto& [id, job] : live_) {
        if (job->running_s() > *settings_.time_limit_s) job->ask_to_stop(StopReason::out_of_time);
      }
    }
    lock.unlock();
    store_.expire(settings_.retention, system_clock::now());
    lock.lock();
    time_passes_.wait_for(lock, stop, tick, [] { return false; });
  }
}

}  // namespace penumbra::jobs
