#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "api/problem.h"

namespace penumbra::http {

inline constexpr std::size_t max_path_bytes = 200, max_target_bytes = 2048;

/// Request line and header fields (RFC 9112), checked before the HTTP library sees them.
struct RequestHead {
  /// Why it is refused, which ends its connection. What was read before that is told all the same.
  std::optional<api::Problem> problem;
  /// What the library may read: the request line and the fields that somebody asks for, in the library's own spelling.
  std::string text;
  std::string method, target;  // empty where they are refused
  std::size_t body_bytes = 0;
  /// What the client says of the request: nothing where it is said twice.
  std::optional<std::string> request_id, traceparent, origin;
  /// Whether the connection ends with this request: the client said so, or it cannot be told where the next begins.
  bool is_last = false;
};

/// Checks `head`, which ends with an empty line. Refuses whatever two readers could understand differently: line ends
/// other than CRLF, folded or nameless fields, a repeated or unreadable Content-Length, any Transfer-Encoding; and what
/// the library would do without a limit: compressed bodies, long paths.
RequestHead check_head(std::string_view head, std::size_t max_body_bytes);

}  // namespace penumbra::http
