#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace penumbra::log {

enum class Format { json, text };

/// The logger that takes entries made of members; its lines are not messages.
inline constexpr const char* access_logger = "access";

class BackgroundLines;

/// For as long as it lives, what spdlog is told goes to standard error, an entry a line, control characters escaped: as
/// JSON objects with `time`, `level` and `message` (or the members given to the access logger), or as text. `level` is
/// debug, info, warning, error or off. Nobody who logs waits for who reads: when a megabyte waits, lines are dropped,
/// and one says later how many.
class Output {
 public:
  Output(Format format, const std::string& level);
  ~Output();
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

 private:
  std::shared_ptr<BackgroundLines> lines_;
};

/// How many lines this process has dropped.
std::uint64_t dropped_lines();

/// `text` as a JSON string with its quotes; bytes that are not UTF-8 become U+FFFD.
std::string quoted(std::string_view text);

}  // namespace penumbra::log
