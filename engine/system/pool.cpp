#include "engine/system/pool.h"

#include <sched.h>

#include <algorithm>

namespace penumbra::system {

struct Pool::Batch {
  const std::function<void(std::int64_t)>* task;
  std::int64_t count;
  int at_most;
  // Guarded by Pool::mutex_:
  std::int64_t next = 0, finished = 0;
  int threads_at_work = 0;
  std::condition_variable_any all_finished;
};

Pool::Pool(int threads, bool idle_priority) {
  for (int i = 0; i < threads; ++i) {
    workers_.emplace_back([this, idle_priority](const std::stop_token& stop) {
      const sched_param priority{};
      if (idle_priority) sched_setscheduler(0, SCHED_IDLE, &priority);
      work(stop);
    });
  }
}

Pool::~Pool() {
  for (std::jthread& worker : workers_) worker.request_stop();
}

std::shared_ptr<Pool::Batch> Pool::next_batch() {
  std::shared_ptr<Batch> best;
  for (const std::shared_ptr<Batch>& batch : batches_) {
    if (batch->threads_at_work >= batch->at_most) continue;
    if (!best || batch->threads_at_work < best->threads_at_work) best = batch;
  }
  return best;
}

void Pool::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (true) {
    std::shared_ptr<Batch> batch;
    if (!work_available_.wait(lock, stop, [&] { return (batch = next_batch()) != nullptr; })) return;
    const std::int64_t index = batch->next++;
    ++batch->threads_at_work;
    const auto place = std::find(batches_.begin(), batches_.end(), batch);
    // The turn moves on: of batches with equally many threads the one served longest ago comes first.
    if (batch->next == batch->count) {
      batches_.erase(place);
    } else {
      std::rotate(place, place + 1, batches_.end());
    }
    lock.unlock();
    (*batch->task)(index);
    lock.lock();
    --batch->threads_at_work;
    if (++batch->finished == batch->count) {
      batch->all_finished.notify_all();
    } else if (batch->next < batch->count) {
      work_available_.notify_one();
    }
  }
}

void Pool::run(std::int64_t count, int at_most, const std::function<void(std::int64_t)>& task) {
  if (count <= 0) return;
  const auto batch = std::make_shared<Batch>();
  batch->task = &task;
  batch->count = count;
  batch->at_most = std::max(1, at_most);
  std::unique_lock lock(mutex_);
  batches_.push_back(batch);
  work_available_.notify_all();
  batch->all_finished.wait(lock, [&] { return batch->finished == count; });
}

}  // namespace penumbra::system
