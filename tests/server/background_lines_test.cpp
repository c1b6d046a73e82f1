#include "server/log/background_lines.h"

#include <doctest/doctest.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <string>

using penumbra::log::BackgroundLines;

namespace {

struct Pipe {
  Pipe() { REQUIRE(pipe(ends.data()) == 0); }
  ~Pipe() {
    for (const int end : ends) close(end);
  }
  /// All that comes, up to the line `last`.
  std::string read_until(const std::string& last) {
    std::string text;
    std::array<char, 65'536> bytes;
    while (!text.ends_with(last)) {
      const ssize_t count = read(ends[0], bytes.data(), bytes.size());
      REQUIRE(count > 0);
      text.append(bytes.data(), static_cast<std::size_t>(count));
    }
    return text;
  }
  /// What comes until nothing has come for a while.
  void drain() {
    std::array<char, 65'536> bytes;
    pollfd watched{ends[0], POLLIN, 0};
    while (poll(&watched, 1, 500) > 0) REQUIRE(read(ends[0], bytes.data(), bytes.size()) > 0);
  }
  std::array<int, 2> ends;
};

std::string note(std::uint64_t count) { return std::to_string(count) + " missing\n"; }

}  // namespace

TEST_CASE("lines come in order, all of them when they are read") {
  Pipe pipe;
  std::string expected;
  {
    BackgroundLines lines(pipe.ends[1], 1 << 20, note);
    for (int i = 0; i < 1000; ++i) {
      const std::string line = "line " + std::to_string(i) + "\n";
      CHECK(lines.add(line));
      expected += line;
    }
    CHECK(pipe.read_until("line 999\n") == expected);
  }
}

TEST_CASE("who has a line to write never waits, and a gap says how many are missing") {
  Pipe pipe;
  const std::string line = std::string(999, 'x') + "\n";
  int taken = 0, dropped = 0;
  {
    BackgroundLines lines(pipe.ends[1], 100'000, note);
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < 10'000; ++i) ++(lines.add(line) ? taken : dropped);
    CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(5));
    CHECK(dropped > 9000);
    const std::string last = std::to_string(dropped) + " missing\n", text = pipe.read_until(last);
    CHECK(text.size() == line.size() * static_cast<std::size_t>(taken) + last.size());
    CHECK(lines.add("after\n"));
    CHECK(pipe.read_until("after\n") == "after\n");
    // The end does not wait for a reader either.
    for (int i = 0; i < 200; ++i) lines.add(line);
  }
  // Its thread still writes, and the pipe is not to be closed meanwhile.
  pipe.drain();
}
