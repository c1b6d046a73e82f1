#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "api/problem.h"
#include "server/http/fields.h"

namespace penumbra::http {

inline constexpr std::size_t max_path_bytes = 200, max_target_bytes = 2048;

/// Request line and header fields (RFC 9112), checked before the HTTP library sees them.
struct RequestHead {
  /// Why it is refused, which ends its connection. What was read before that is told all the same.
  std::optional<api::Problem> problem;
  /// What the library may read: the request line, and what it needs to know of the body.
  std::string text;
  std::string method, target;  // empty where they are refused
  std::string host;            // in lower case, an IPv6 address without brackets
  FieldValues fields;
  std::size_t body_bytes = 0;
  bool is_body_gzip = false;
  /// HTTP/1.1: the client knows answers that are followed by others.
  bool is_interim_known = false;
  /// Whether the connection ends with this request: the client said so, or it cannot be told where the next begins.
  bool is_last = false;
};

/// Checks `head`, which ends with an empty line; lines end with CRLF or LF. Refuses whatever two readers could
/// understand differently: folded or nameless fields, an unreadable Content-Length, any Transfer-Encoding, lines that
/// must not repeat; and long paths, for which the library would do too much.
RequestHead check_head(std::string_view head, std::size_t max_body_bytes);

/// The end of the first head in `text` – behind its empty line – looking from `from` on; npos while there is none.
std::size_t end_of_head(std::string_view text, std::size_t from);

/// Whether a request may begin with this.
bool may_be_request(std::string_view begin);

}  // namespace penumbra::http
