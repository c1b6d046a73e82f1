#pragma once
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

namespace penumbra::log {

/// Lines on their way to a descriptor, written by a thread of its own: whoever has one to write never waits. When more
/// wait than `max_bytes`, further ones are dropped and counted. May be shared between threads.
class BackgroundLines {
 public:
  /// What is to be written where `count` lines are missing.
  using NoteOfGap = std::function<std::string(std::uint64_t count)>;

  BackgroundLines(int descriptor, std::size_t max_bytes, NoteOfGap note_of_gap);
  /// Waits a second at most for what is still to be written; a reader that has stopped reading is left with it.
  ~BackgroundLines();
  BackgroundLines(const BackgroundLines&) = delete;
  BackgroundLines& operator=(const BackgroundLines&) = delete;

  /// `line` ends with its line break. False when it was dropped.
  bool add(std::string_view line);

 private:
  struct State;
  static void write_all(const std::shared_ptr<State>& state);

  std::shared_ptr<State> state_;  // the thread's too: it may outlive this, blocked
};

}  // namespace penumbra::log
