#include "server/log/log.h"

#include <spdlog/formatter.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <memory>
#include <mutex>

#include "server/log/background_lines.h"

namespace penumbra::log {

namespace {

constexpr std::size_t max_waiting_bytes = 1u << 20;

std::atomic<std::uint64_t> dropped = 0;  // lines

/// How many bytes the character at the start of `text` has; 0 when it is not UTF-8 (RFC 3629, section 4).
std::size_t character_bytes(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const auto follows = [&](std::size_t i, unsigned least = 0x80, unsigned most = 0xbf) {
    return byte(i) >= least && byte(i) <= most;
  };
  if (first >= 0xc2 && first <= 0xdf) return follows(1) ? 2 : 0;
  if (first >= 0xe0 && first <= 0xef) {
    const unsigned least = first == 0xe0 ? 0xa0 : 0x80, most = first == 0xed ? 0x9f : 0xbf;
    return follows(1, least, most) && follows(2) ? 3 : 0;
  }
  if (first < 0xf0 || first > 0xf4) return 0;
  const unsigned least = first == 0xf0 ? 0x90 : 0x80, most = first == 0xf4 ? 0x8f : 0xbf;
  return follows(1, least, most) && follows(2) && follows(3) ? 4 : 0;
}

class Formatter : public spdlog::formatter {
 public:
  explicit Formatter(Format format) : format_(format) {}

  void format(const spdlog::details::log_msg& entry, spdlog::memory_buf_t& line) override {
    const std::string_view text(entry.payload.data(), entry.payload.size());
    const bool is_members = std::string_view(entry.logger_name.data(), entry.logger_name.size()) == access_logger;
    const auto level = spdlog::level::to_string_view(entry.level);
    spdlog::memory_buf_t time;
    time_.format(entry, time);
    const auto append = [&](std::string_view part) { line.append(part.data(), part.data() + part.size()); };
    append(format_ == Format::json ? "{\"time\":\"" : "");
    append({time.data(), time.size()});
    append(format_ == Format::json ? "\",\"level\":\"" : " ");
    append({level.data(), level.size()});
    if (format_ == Format::json) {
      append(is_members ? "\"," : "\",\"message\":");
      append(is_members ? std::string(text) : quoted(text));
      append("}\n");
    } else {
      // As in the JSON string, without its quotes.
      const std::string escaped = quoted(text);
      append(" ");
      append(is_members ? text : std::string_view(escaped).substr(1, escaped.size() - 2));
      append("\n");
    }
  }

  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<Formatter>(format_); }

 private:
  const Format format_;
  spdlog::pattern_formatter time_{"%Y-%m-%dT%H:%M:%S.%eZ", spdlog::pattern_time_type::utc, ""};
};

class Sink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit Sink(std::shared_ptr<BackgroundLines> lines) : lines_(std::move(lines)) {}

 private:
  void sink_it_(const spdlog::details::log_msg& entry) override {
    spdlog::memory_buf_t line;
    formatter_->format(entry, line);
    if (!lines_->add({line.data(), line.size()})) ++dropped;
  }
  void flush_() override {}

  const std::shared_ptr<BackgroundLines> lines_;
};

/// A line like the others.
std::string note_of_gap(Format format, std::uint64_t count) {
  const std::string text = std::to_string(count) + " lines of the log were dropped: nobody read them in time";
  spdlog::memory_buf_t line;
  Formatter(format).format({"penumbra", spdlog::level::warn, text}, line);
  return {line.data(), line.size()};
}

}  // namespace

std::uint64_t dropped_lines() { return dropped; }

Output::Output(Format format, const std::string& level)
    : lines_(std::make_shared<BackgroundLines>(STDERR_FILENO, max_waiting_bytes,
                                               [format](std::uint64_t count) { return note_of_gap(format, count); })) {
  const auto sink = std::make_shared<Sink>(lines_);
  const auto logger = std::make_shared<spdlog::logger>("penumbra", sink);
  const auto access = std::make_shared<spdlog::logger>(access_logger, sink);
  for (const auto& each : {logger, access}) {
    each->set_formatter(std::make_unique<Formatter>(format));
    each->set_level(spdlog::level::from_str(level));
  }
  spdlog::set_default_logger(logger);
  spdlog::drop(access_logger);
  spdlog::register_logger(access);
}

Output::~Output() {
  // The loggers hold the lines too. What is logged from now on goes nowhere.
  spdlog::drop_all();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("penumbra"));
}

std::string quoted(std::string_view text) {
  std::string result = "\"";
  while (!text.empty()) {
    const char c = text.front();
    const std::size_t bytes = character_bytes(text);
    if (bytes == 0) {
      result += "\xef\xbf\xbd";
    } else if (bytes > 1) {
      result.append(text.substr(0, bytes));
    } else if (c == '"' || c == '\\') {
      result.append(1, '\\').append(1, c);
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      char escaped[8];
      std::snprintf(escaped, sizeof escaped, "\\u%04x", static_cast<unsigned>(c));
      result += escaped;
    } else {
      result += c;
    }
    text.remove_prefix(std::max<std::size_t>(1, bytes));
  }
  return result + '"';
}

}  // namespace penumbra::log
