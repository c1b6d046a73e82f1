#include "server/http/request_ids.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

namespace penumbra::http {

namespace {

constexpr std::string_view hex_digits = "0123456789abcdef";

bool is_hex(std::string_view text) { return text.find_first_not_of(hex_digits) == std::string_view::npos; }

/// Hexadecimal, and not all zeros.
bool is_trace_part(std::string_view text) {
  return is_hex(text) && text.find_first_not_of('0') != std::string_view::npos;
}

}  // namespace

std::optional<TraceParent> parse_traceparent(std::string_view text) {
  // version "-" trace-id "-" parent-id "-" flags
  constexpr std::size_t trace_begin = 3, parent_begin = 36, flags_begin = 53, size = 55;
  if (text.size() < size || text[2] != '-' || text[parent_begin - 1] != '-' || text[flags_begin - 1] != '-')
    return std::nullopt;
  const std::string_view version = text.substr(0, 2), trace = text.substr(trace_begin, 32),
                         parent = text.substr(parent_begin, 16), flags = text.substr(flags_begin, 2);
  const bool is_end_right = text.size() == size || (version != "00" && text[size] == '-');
  if (!is_hex(version) || version == "ff" || !is_end_right || !is_trace_part(trace) || !is_trace_part(parent) ||
      !is_hex(flags))
    return std::nullopt;
  return TraceParent{std::string(trace), std::string(parent), hex_digits.find(flags[1]) % 2 == 1};
}

bool is_request_id(std::string_view text) {
  return !text.empty() && text.size() <= 128 && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_' ||
           c == '.' || c == ':';
  });
}

std::string fresh_request_id() {
  std::array<unsigned char, 16> random;
  if (getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(random.size()))
    throw std::system_error(errno, std::generic_category(), "getrandom");
  std::string id;
  for (const unsigned char byte : random) {
    id += hex_digits[byte >> 4];
    id += hex_digits[byte & 15];
  }
  return id;
}

}  // namespace penumbra::http
