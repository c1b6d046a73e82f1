#include <spdlog/spdlog.h>

#include <algorithm>
#include <new>

#include "api/problems.h"
#include "engine/output/encode.h"
#include "engine/output/thumbnail.h"
#include "engine/render/render.h"
#include "server/jobs/endings.h"
#include "server/jobs/job_manager.h"
#include "server/store/sha256.h"

namespace penumbra::jobs {

using std::chrono::system_clock;

void JobManager::run_jobs(const std::stop_token& stop) {
  while (const std::shared_ptr<SharedRender> render = queue_.take_next(stop)) run(render);
}

void JobManager::run(const std::shared_ptr<SharedRender>& render) {
  std::optional<store::Ending> ending;
  try {
    ending = start_and_render(render);
  } catch (const api::InvalidBody& invalid) {
    // Accepted once, but not by this version or under these limits.
    ending = failure(invalid.problem());
  } catch (const store::StoreFailed&) {
    ending.reset();
  } catch (const store::StorageFull&) {
    ending = not_stored();
  } catch (const std::bad_alloc&) {
    spdlog::error("a render: out of memory");
    ending = failure(api::out_of_memory());
  } catch (const std::exception& error) {
    spdlog::error("a render: {}", error.what());
    ending = failure(api::render_failed("the render failed; the log says why"));
  }
  if (settings_.on_image && ending && ending->stats) settings_.on_image(*ending->stats);
  const double took_s = render->running_s();
  {
    const std::lock_guard lock(mutex_);
    average_s_ += (took_s - average_s_) / 8;
  }
  for (const auto& [job, is_to_be_canceled] : queue_.finish(*render)) {
    if (is_to_be_canceled) {
      end(*job, stopped(StopReason::canceled, 0));
    } else if (ending) {
      end(*job, *ending);
    } else {
      leave(*job);
    }
  }
}

std::unique_ptr<api::JobRequest> JobManager::request_of(SharedRender& render) const {
  if (std::unique_ptr<api::JobRequest> request = render.take_request()) return request;
  for (const std::shared_ptr<LiveJob>& job : queue_.jobs_of(render)) {
    // Nothing when it has been canceled just now.
    const std::optional<std::string> body = store_.spec(job->id());
    if (body) return std::make_unique<api::JobRequest>(api::parse_job(*body, settings_.limits));
  }
  return nullptr;
}

void JobManager::start(LiveJob& job, const std::shared_ptr<SharedRender>& render) {
  const api::Time now = job.not_before(system_clock::now());
  if (!store_.start(job.id(), now)) return;
  if (!job.start(now, render)) return put_back(job);
  if (settings_.on_start) settings_.on_start(std::chrono::duration<double>(now - job.created_at()).count());
  spdlog::debug("job {} started", job.id());
}

std::optional<store::Ending> JobManager::start_and_render(const std::shared_ptr<SharedRender>& render) {
  const std::unique_ptr<api::JobRequest> request = request_of(*render);
  if (!request) return stopped(StopReason::canceled, 0);
  if (render->memory_bytes() == 0) queue_.wait_for_room(*render, api::estimate_cost(*request).memory_bytes);
  render->start(request->options.width, request->options.height);
  for (const std::shared_ptr<LiveJob>& job : queue_.jobs_of(*render)) start(*job, render);
  return rendered(*render, *request);
}

std::optional<store::Ending> JobManager::rendered(SharedRender& render, const api::JobRequest& request) {
  const auto stopped_here = [&](StopReason reason) -> std::optional<store::Ending> {
    if (reason == StopReason::server_stopped) return std::nullopt;
    return stopped(reason, settings_.time_limit_s.value_or(0));
  };
  if (const auto reason = render.stop_reason()) return stopped_here(*reason);
  if (request.options.format == scene::ImageFormat::exr) output::preload();
  std::optional<render::Picture> picture = render::render(request.scene, request.options, pool_, render.control);
  if (const auto reason = render.stop_reason()) return stopped_here(*reason);
  if (!picture) return failure(api::render_failed("the render gave no image"));

  const Clock::time_point start = Clock::now();
  const output::Encoding encoding = output::encoding_of(request.options);
  store::Image image;
  image.bytes = std::make_shared<const std::string>(output::encode(*picture->film, encoding));
  image.media_type = output::media_type(encoding.format);
  if (std::max(picture->film->width, picture->film->height) > thumbnail_edge) {
    // As the image looks, or its preview.
    const bool is_png = encoding.format == scene::ImageFormat::png;
    const output::Encoding small{scene::ImageFormat::png, is_png ? encoding.transfer : scene::Transfer::srgb};
    const render::Film film = output::thumbnail(*picture->film, thumbnail_edge);
    image.thumbnail = std::make_shared<const std::string>(output::encode(film, small));
  }
  picture->stats.encode_s = std::chrono::duration<double>(Clock::now() - start).count();
  image.sha256 = store::sha256_hex(*image.bytes);
  if (encoding.format != scene::ImageFormat::png)
    image.png_preview = std::make_shared<const std::string>(output::encode(*picture->film, output::Encoding{}));
  // Whoever asked for a cancel was told that the job is on its way there.
  if (const auto reason = render.stop_reason()) return stopped_here(*reason);

  store::Ending ending;
  ending.stats = picture->stats;
  ending.image = std::move(image);
  return ending;
}

bool JobManager::store_ending(const LiveJob& job, store::Ending& ending, WhenFull when_full) {
  constexpr auto pause = std::chrono::seconds(1);
  constexpr int most_tries = 30;  // to store the image, where not the disk is full but, say, descriptors are short
  for (int tries = 1;; ++tries) {
    bool is_full = false;
    try {
      store_.finish(job.id(), ending);
      return true;
    } catch (const store::StoreFailed&) {
      return false;
    } catch (const store::StorageFull& error) {
      if (when_full == WhenFull::fail) throw;
      is_full = true;
      spdlog::error("job {}: its end cannot be stored: {}", job.id(), error.what());
    } catch (const std::exception& error) {
      spdlog::error("job {}: its end cannot be stored yet: {}", job.id(), error.what());
    }
    if (ending.image && (is_full || tries >= most_tries)) {
      const api::Time finished_at = ending.finished_at;
      ending = not_stored();
      ending.finished_at = finished_at;
      ending.percent = job.resource().percent;
      continue;
    }
    // Not even a few bytes: until there is room again, or somebody ends the server.
    std::unique_lock lock(mutex_);
    if (time_passes_.wait_for(lock, pause, [&] { return is_stopping_; })) return false;
  }
}

void JobManager::end(LiveJob& job, store::Ending ending, WhenFull when_full) {
  // Stored before anyone hears of it.
  if (ending.state != api::JobState::succeeded) ending.percent = job.resource().percent;
  ending.finished_at = job.not_before(system_clock::now());
  if (!store_ending(job, ending, when_full)) return leave(job);
  spdlog::debug("job {} {}", job.id(), api::name_of(ending.state));
  expire();
  {
    const std::lock_guard lock(mutex_);
    switch (ending.state) {
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
  job.end(ending);
}

void JobManager::leave(LiveJob& job) {
  // First, so that either this finds it running or who starts it finds it left.
  job.leave();
  if (job.resource().state == api::JobState::running) put_back(job);
  {
    const std::lock_guard lock(mutex_);
    drop_live(job.id());
  }
  if (!queue_.is_to_be_canceled(job)) return;
  try {
    cancel_left(job.id());
  } catch (const std::exception& error) {
    spdlog::error("job {}: goes on at the next start, for its cancel cannot be stored: {}", job.id(), error.what());
  }
}

void JobManager::put_back(const LiveJob& job) {
  try {
    store_.put_back(job.id(), job.resource().percent);
  } catch (const std::exception& error) {
    spdlog::error("job {}: the store counts it as one the server died of: {}", job.id(), error.what());
  }
}

void JobManager::expire() {
  try {
    store_.expire(retention_, retention_clock_.tell(system_clock::now(), Clock::now()));
  } catch (const std::exception& error) {
    spdlog::error("nothing can be removed from the store: {}", error.what());
  }
}

void JobManager::keep_time(const std::stop_token& stop) {
  using std::chrono::duration_cast;
  const double tick_s = std::clamp(settings_.time_limit_s.value_or(10) / 10, 0.01, 1.0);
  const auto tick = duration_cast<Clock::duration>(std::chrono::duration<double>(tick_s));
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    lock.unlock();
    if (settings_.time_limit_s) queue_.stop_overdue(*settings_.time_limit_s);
    expire();
    lock.lock();
    time_passes_.wait_for(lock, stop, tick, [] { return false; });
  }
}

}  // namespace penumbra::jobs
