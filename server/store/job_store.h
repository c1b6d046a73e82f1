#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "api/job_resource.h"

namespace penumbra::store {

using api::JobState;
using api::Time;

/// What is kept of a job, its spec and its image aside.
struct JobRecord {
  std::string id;         // ids of later jobs are greater, byte by byte
  std::string owner;      // who may see it; empty: no keys are asked for
  std::string spec_hash;  // jobs of equal hashes have the same image; empty: this one's is like no other
  JobState state = JobState::queued;
  int priority = 0;
  double progress_interval_s = 0.5;
  double percent = 0;  // where a job that has ended or was put back stood
  int crashes = 0;     // how often the server died while it rendered this
  Time created_at;
  std::optional<Time> started_at, finished_at;
  std::optional<api::Problem> error;
  std::optional<render::Stats> stats;
  std::string name;                         // of the scene
  std::optional<api::ImageShape> shape;     // nothing where an earlier version has not noted it
  std::optional<std::uint64_t> size_bytes;  // of the image, while it is kept
  bool is_awaited = false;                  // made by a call that waits for the image: nobody else wants it
};

/// Bytes of a finished job; shared, for they may be large.
struct Image {
  std::shared_ptr<const std::string> bytes;
  std::string media_type;
  std::string sha256;  // of `bytes`, in hexadecimal
  /// The same picture as PNG, where `bytes` are no PNG.
  std::shared_ptr<const std::string> png_preview;
  /// The picture in small, as PNG; nothing when it is small itself.
  std::shared_ptr<const std::string> thumbnail;
};

/// What a client chose so that a repeated call makes no second job, and the hash of the body it came with. Different
/// owners' keys have nothing to do with each other.
struct IdempotencyKey {
  std::string key;
  std::string body_sha256;
  std::string owner;
};

struct Created {
  enum class Outcome {
    created,   // stored; already succeeded when an equal job's image was there
    repeated,  // the key has been used with the same body: `job` is what it made
    conflict,  // the key has been used with another body; nothing was stored
  };
  Outcome outcome = Outcome::created;
  JobRecord job;
};

/// How a job ended.
struct Ending {
  JobState state = JobState::succeeded;  // a final one
  double percent = 100;
  Time finished_at;
  std::optional<api::Problem> error;
  std::optional<render::Stats> stats;
  std::optional<Image> image;
};

/// Which jobs to list: those of one state, of one owner, or all.
struct Filter {
  std::optional<JobState> state;
  std::optional<std::string> owner;
};

struct Page {
  std::vector<JobRecord> jobs;
  std::optional<std::string> next_page_token;  // nothing on the last page
};

/// How long finished work is kept.
struct Retention {
  std::size_t max_jobs = 10'000;             // finished ones
  std::size_t max_image_bytes = 512u << 20;  // of all images
  std::size_t max_spec_bytes = 256u << 20;   // of the bodies of all jobs, of which those of finished ones may go
  std::chrono::seconds image_age = std::chrono::hours(24);
  std::chrono::seconds job_age = std::chrono::hours(7 * 24);
  /// Of which jobs nothing may go; called in the thread that drops things.
  std::function<bool(const std::string& id)> is_held = [](const std::string&) { return false; };
};

enum class ImageState { none, present, expired };

struct FoundImage {
  ImageState state = ImageState::none;
  Image image;  // when present
};

/// There is not enough room on the disk; nothing was changed.
class StorageFull : public std::runtime_error {
 public:
  StorageFull() : std::runtime_error("the disk is too full") {}
};

/// The store has met an error after which nobody knows what the disk holds. It takes no changes any more; whether the
/// one that threw this was made shows at the next start.
class StoreFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Where jobs live: the one interface of every store. What a call that changes something has returned from, a durable
/// store will not lose. All members may be called from any thread. Those that change something may throw StorageFull
/// and StoreFailed.
class JobStore {
 public:
  virtual ~JobStore() = default;

  /// Stores a queued job and the body it was made from. When the image of a job with the same spec_hash is kept, the
  /// new job has it too and has succeeded. A key whose job was canceled is free again.
  virtual Created create(const JobRecord& job, std::string spec, const std::optional<IdempotencyKey>& key) = 0;
  /// What `create` would answer to this key if it is taken.
  virtual std::optional<Created> find_key(const IdempotencyKey& key) const = 0;

  /// The key that made this job is free again from now on.
  virtual void free_key(const std::string& id) = 0;

  /// queued → running. False when the job is gone or not queued.
  virtual bool start(const std::string& id, Time started_at) = 0;
  /// running → queued: an orderly stop, `percent` into the job. False when the job is gone or not running.
  virtual bool put_back(const std::string& id, double percent) = 0;
  /// Any unfinished state → the ending, no earlier than the last one's if the clock was set back. False, and nothing
  /// changes, when the job is gone or has ended.
  virtual bool finish(const std::string& id, Ending ending) = 0;
  /// Forgets the job, its image and its key. False when there is no such job.
  virtual bool remove(const std::string& id) = 0;

  virtual std::optional<JobRecord> find(const std::string& id) const = 0;
  /// The body a job was made from; nothing when it is kept no more, or there is no such job.
  virtual std::optional<std::string> spec(const std::string& id) const = 0;
  /// Nothing when there is no such job.
  virtual std::optional<FoundImage> image(const std::string& id) const = 0;
  /// The image's thumbnail, without bytes when the image has none; nothing when there is no such job.
  virtual std::optional<FoundImage> thumbnail(const std::string& id) const = 0;
  /// At most `limit` ≥ 1 jobs, newest first; `page_token` is that of the page before.
  virtual Page list(const Filter& filter, std::size_t limit, const std::optional<std::string>& page_token) const = 0;
  /// Queued and running jobs, oldest first: what is left to do after a restart.
  virtual std::vector<JobRecord> unfinished() const = 0;
  /// The greatest id there is; empty when there are no jobs. New ones must be greater, whatever the clock says.
  virtual std::string newest_id() const = 0;

  /// Drops images and specs, then finished jobs, that are older than allowed or too many, those first that ended first.
  virtual void expire(const Retention& retention, Time now) = 0;
};

}  // namespace penumbra::store
