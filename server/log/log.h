#pragma once
#include <string>
#include <string_view>

namespace penumbra::log {

enum class Format { json, text };

/// The logger that takes entries made of members; its lines are not messages.
inline constexpr const char* access_logger = "access";

/// Sends what spdlog is told to standard error, an entry a line, control characters escaped: as JSON objects with
/// `time`, `level` and `message` (or the members given to the access logger), or as text. `level` is debug, info,
/// warning, error or off.
void configure(Format format, const std::string& level);

/// `text` as a JSON string with its quotes; bytes that are not UTF-8 become U+FFFD.
std::string quoted(std::string_view text);

}  // namespace penumbra::log
