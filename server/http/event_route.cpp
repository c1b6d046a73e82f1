#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <mutex>

#include "api/problems.h"
#include "server/http/routes.h"

namespace penumbra::http {

namespace {

using jobs::Clock;
using jobs::JobManager;

constexpr std::chrono::milliseconds turn(500), comment_interval(15'000);
constexpr double least_interval_s = 0.02;
constexpr std::uint64_t final_event_id = 20'000;
/// What an EventSource does when its stream ends: it comes back after so long. Any other answer than this ends it for
/// good.
constexpr std::string_view come_back = "retry: 1000\n\n", come_back_later = "retry: 2000\n\n";

/// Ids grow with the percentage, so that a client that comes back with the last one it saw is told only what is newer –
/// by any server, for nothing of the past need be kept.
std::uint64_t event_id_of(const api::JobResource& job) {
  if (api::is_final(job.state)) return final_event_id;
  if (job.state == api::JobState::queued) return 1;
  return 2 + static_cast<std::uint64_t>(std::floor(100 * std::clamp(job.percent, 0.0, 100.0)));
}

std::string event_text(std::string_view name, const api::JobResource& job) {
  std::string text = "id: " + std::to_string(event_id_of(job)) + "\nevent: ";
  return text.append(name).append("\ndata: ").append(api::progress_json(job)).append("\n\n");
}

/// Open streams are counted, so that their threads cannot run out, and no client takes them all.
class StreamSlots {
 public:
  StreamSlots(const StreamLimits& limits, metrics::Metrics& metrics) : limits_(limits), metrics_(metrics) {}

  /// Held as long as the result lives; null when there is none left. This must outlive the result.
  std::shared_ptr<void> take(const std::string& client) {
    const std::lock_guard lock(mutex_);
    std::size_t& own = of_client_[client];
    if (taken_ >= limits_.all || own >= limits_.of_one_client) {
      if (own == 0) of_client_.erase(client);
      return nullptr;
    }
    ++taken_, ++own;
    metrics_.event_streams_changed(1);
    return {this, [client](void* slots) { static_cast<StreamSlots*>(slots)->give_back(client); }};
  }

 private:
  void give_back(const std::string& client) {
    metrics_.event_streams_changed(-1);
    const std::lock_guard lock(mutex_);
    --taken_;
    const auto own = of_client_.find(client);
    if (--own->second == 0) of_client_.erase(own);
  }

  const StreamLimits limits_;
  metrics::Metrics& metrics_;
  std::mutex mutex_;
  // Guarded by mutex_:
  std::size_t taken_ = 0;
  std::map<std::string, std::size_t> of_client_;
};

/// One client's stream of one job.
class JobEvents {
 public:
  JobEvents(const JobManager& manager, api::JobResource job, double interval_s, std::uint64_t last_id,
            std::function<bool()> is_wanted, std::shared_ptr<void> slot)
      : manager_(manager),
        job_(std::move(job)),
        interval_(std::chrono::duration_cast<Clock::duration>(
            std::chrono::duration<double>(std::max(interval_s, least_interval_s)))),
        last_id_(last_id),
        is_wanted_(std::move(is_wanted)),
        slot_(std::move(slot)) {}

  /// One turn: waits for news, at most half a second, and sends them. False once the stream has ended.
  bool operator()(const Send& send) {
    if (is_first_turn_) {
      is_first_turn_ = false;
      if (!send(come_back)) return false;
    } else {
      wait_for_news();
    }
    if (!is_wanted_()) return false;
    if (api::is_final(job_.state)) {
      send(event_text(api::name_of(job_.state), job_));
      return false;
    }
    // Whoever comes back to the next server is told the rest.
    if (manager_.is_stopping()) return false;
    const Clock::time_point now = Clock::now();
    if (now >= due_ && event_id_of(job_) > last_id_) {
      last_id_ = event_id_of(job_);
      due_ = now + interval_;
      return note_sent(now, send(event_text("progress", job_)));
    }
    if (now - last_sent_ >= comment_interval) return note_sent(now, send(": the stream is alive\n\n"));
    return true;
  }

 private:
  void wait_for_news() {
    const Clock::time_point now = Clock::now();
    // Nothing new when a report is due: look again soon, but not in a tight loop.
    const auto pause = std::max(due_ - now, std::min<Clock::duration>(interval_, std::chrono::milliseconds(100)));
    std::optional<api::JobResource> job = manager_.wait(job_.id, now + std::min<Clock::duration>(pause, turn));
    if (job) {
      job_ = *job;
    } else {
      // Deleted while it was watched.
      job_.state = api::JobState::canceled;
    }
  }

  bool note_sent(Clock::time_point now, bool is_sent) {
    last_sent_ = now;
    return is_sent;
  }

  const JobManager& manager_;
  api::JobResource job_;
  Clock::duration interval_;
  std::uint64_t last_id_;
  std::function<bool()> is_wanted_;
  std::shared_ptr<void> slot_;
  bool is_first_turn_ = true;
  Clock::time_point due_ = Clock::now(), last_sent_ = Clock::now();
};

Response event_stream(Producer producer) {
  return {200, "text/event-stream", std::move(producer), {{"Cache-Control", "no-store"}, {"X-Accel-Buffering", "no"}}};
}

std::uint64_t last_event_id(const Request& request) {
  const std::string_view text = request.fields[Field::last_event_id].value_or("");
  std::uint64_t id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  return error == std::errc() && end == text.data() + text.size() ? id : 0;
}

}  // namespace

void add_event_route(Router& router, JobManager& manager, metrics::Metrics& metrics, const StreamLimits& limits) {
  const auto slots = std::make_shared<StreamSlots>(limits, metrics);
  const auto handler = [&manager, slots](const Request& request) -> Response {
    const std::optional<api::JobResource> job = manager.find(request.id);
    const std::optional<double> interval_s = manager.progress_interval_s(request.id);
    if (!job || !interval_s) return problem_response(api::no_such_job());
    const std::uint64_t last_id = last_event_id(request);
    // The answer that tells an EventSource to stop coming back.
    if (api::is_final(job->state) && last_id >= final_event_id) return {204, "", std::string(), {}};
    // A key is one client wherever it is used, as a proxy's address is many.
    std::shared_ptr<void> slot =
        slots->take(request.caller.key_id.empty() ? request.client : "key " + request.caller.key_id);
    if (!slot) {
      const Producer producer = [](const Send& send) { return send(come_back_later) && false; };
      return event_stream(producer);
    }
    const auto events =
        std::make_shared<JobEvents>(manager, *job, *interval_s, last_id, request.is_wanted, std::move(slot));
    return event_stream([events](const Send& send) { return (*events)(send); });
  };
  router.add({"GET", "/v1/jobs/{id}/events", Body::none, handler, access::Scope::read, {}, true});
}

}  // namespace penumbra::http
