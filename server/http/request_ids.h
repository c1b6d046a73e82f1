#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace penumbra::http {

/// What a `traceparent` field says (W3C Trace Context, 3.2).
struct TraceParent {
  std::string trace_id, parent_id;  // 32 and 16 hexadecimal digits
  bool is_sampled = false;
  bool operator==(const TraceParent&) const = default;
};

/// Nothing when `text` is not valid; of versions after 00 what 00 knows is read.
std::optional<TraceParent> parse_traceparent(std::string_view text);

/// Whether a client's request id may be taken over: 1 to 128 letters, digits and any of - _ . :
bool is_request_id(std::string_view text);

/// 32 random hexadecimal digits.
std::string fresh_request_id();

}  // namespace penumbra::http
