#include "server/log/background_lines.h"

#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <string_view>
#include <thread>
#include <utility>

namespace penumbra::log {

namespace {

/// Until all of it is written, or never will be.
void write_to(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written >= 0) {
      text.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {
      // Somebody who shares the descriptor has made it non-blocking.
      pollfd watched{descriptor, POLLOUT, 0};
      ::poll(&watched, 1, -1);
    } else if (errno != EINTR) {
      return;
    }
  }
}

}  // namespace

struct BackgroundLines::State {
  int descriptor;
  std::size_t max_bytes;
  NoteOfGap note_of_gap;

  std::mutex mutex;
  std::condition_variable changed;
  // Guarded by mutex:
  std::string waiting;
  std::uint64_t missing = 0;  // lines dropped that nothing has been written about
  bool is_ending = false, has_ended = false;
};

BackgroundLines::BackgroundLines(int descriptor, std::size_t max_bytes, NoteOfGap note_of_gap)
    : state_(std::make_shared<State>()) {
  state_->descriptor = descriptor;
  state_->max_bytes = max_bytes;
  state_->note_of_gap = std::move(note_of_gap);
  // Signals are for other threads.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread([state = state_] { write_all(state); }).detach();
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

BackgroundLines::~BackgroundLines() {
  constexpr auto patience = std::chrono::seconds(1);
  std::unique_lock lock(state_->mutex);
  state_->is_ending = true;
  state_->changed.notify_all();
  state_->changed.wait_for(lock, patience, [&] { return state_->has_ended; });
  // Whose descriptor it is by the time somebody reads on, nobody knows.
  state_->waiting.clear();
}

bool BackgroundLines::add(std::string_view line) {
  const std::lock_guard lock(state_->mutex);
  // After a gap nothing is taken before the gap itself has been written about: its place stays right.
  if (state_->missing > 0 || state_->waiting.size() + line.size() > state_->max_bytes) {
    ++state_->missing;
    return false;
  }
  state_->waiting += line;
  state_->changed.notify_all();
  return true;
}

void BackgroundLines::write_all(const std::shared_ptr<State>& state) {
  std::unique_lock lock(state->mutex);
  while (true) {
    state->changed.wait(lock, [&] { return !state->waiting.empty() || state->is_ending; });
    if (state->waiting.empty()) break;
    const std::string text = std::exchange(state->waiting, {});
    lock.unlock();
    write_to(state->descriptor, text);
    lock.lock();
    if (state->missing > 0 && state->waiting.empty())
      state->waiting = state->note_of_gap(std::exchange(state->missing, 0));
  }
  state->has_ended = true;
  state->changed.notify_all();
}

}  // namespace penumbra::log
